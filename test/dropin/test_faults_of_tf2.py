# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What tf2 gets wrong and the drop-in does not, as docs/deviations.md states about both."""

import json

from dropin_helpers import run
import pytest
from standin import run_with_tf2

COVARIANCE = """
    import json
    import numpy as np
    from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
    import tf2_geometry_msgs

    quarter_turn = TransformStamped()
    quarter_turn.transform.rotation.z = quarter_turn.transform.rotation.w = 2.0
    pose = PoseWithCovarianceStamped()
    pose.pose.pose.orientation.w = 1.0
    pose.pose.covariance = np.diag([1.0, 4.0, 9.0, 1.0, 4.0, 9.0]).ravel().tolist()
    turned = tf2_geometry_msgs.do_transform_pose_with_covariance_stamped(pose, quarter_turn)
    print(json.dumps(np.diag(np.reshape(turned.pose.covariance, (6, 6))).tolist()))
"""

CLOUD = """
    import json
    import numpy as np
    from geometry_msgs.msg import TransformStamped
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_sensor_msgs.tf2_sensor_msgs import do_transform_cloud

    fields = [PointField(name=name, offset=offset, datatype=PointField.FLOAT32, count=1)
              for name, offset in (('z', 0), ('y', 4), ('x', 8))]
    cloud = PointCloud2(height=1, width=1, fields=fields, point_step=12, row_step=12,
                        data=np.array([3.0, 2.0, 1.0], np.float32).tobytes())
    ten_ahead = TransformStamped()
    ten_ahead.transform.translation.x, ten_ahead.transform.rotation.w = 10.0, 1.0
    moved = do_transform_cloud(cloud, ten_ahead)
    print(json.dumps([[field.name for field in moved.fields],
                      np.frombuffer(bytes(moved.data), np.float32).tolist()]))
"""

PROFILE = """
    import json
    import rclpy
    from rclpy.node import Node
    from rclpy.parameter import Parameter
    import tf2_ros

    rclpy.init()
    node = Node('listens', parameter_overrides=[Parameter(
        'qos_overrides./tf.subscription.reliability', value='best_effort')])
    listener = tf2_ros.TransformListener(tf2_ros.Buffer(), node)
    while not (found := node.get_subscriptions_info_by_topic('/tf')):
        rclpy.spin_once(node, timeout_sec=0.01)
    print(json.dumps(found[0].qos_profile.reliability.name))
    rclpy.shutdown()
"""


@pytest.mark.parametrize(('code', 'of_tf2', 'ours'), [
    (COVARIANCE, [305.0, 260.0, 2025.0] * 2, [4.0, 1.0, 9.0] * 2),
    (CLOUD, [['z', 'y', 'x'], [11.0, 2.0, 3.0]], [['z', 'y', 'x'], [3.0, 2.0, 11.0]]),
    (PROFILE, 'RELIABLE', 'BEST_EFFORT'),
], ids=['covariance with a quaternion of any length', 'cloud of z, y, x', 'profile of a topic'])
def test_fault_of_tf2_is_not_ours(program, code, of_tf2, ours):
    here = run('-m', 'tf_tree_py.dropin', '--force', program(code))
    assert here.returncode == 0, here.stderr
    assert rounded(json.loads(here.stdout)) == ours
    assert rounded(json.loads(run_with_tf2(code))) == of_tf2


def rounded(found):
    return [round(number, 9) for number in found] if isinstance(found[0], float) else found
