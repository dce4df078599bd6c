# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""ROS 2's ``TransformStamped``, constructed through its public interface."""

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

from ..motion import Edge, Pose


def transform_stamped(edge: Edge, stamp: int, pose: Pose) -> TransformStamped:
    """Return a transform as a message."""
    x, y, z, qx, qy, qz, qw = pose
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return TransformStamped(
        header=Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=edge.parent),
        child_frame_id=edge.child,
        transform=Transform(translation=Vector3(x=x, y=y, z=z),
                            rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)))


def pose_of(message: TransformStamped) -> Sequence[float]:
    """Return the seven numbers of the pose in a message."""
    t, q = message.transform.translation, message.transform.rotation
    return t.x, t.y, t.z, q.x, q.y, q.z, q.w
