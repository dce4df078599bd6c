# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Buffers, registries and clients of tf2's kind."""


from geometry_msgs.msg import (
    Point,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3Stamped,
)
import numpy as np
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import at, lasting, PATIENCE, transform
from std_msgs.msg import Header
from tf2_msgs.action import LookupTransform
import tf_tree_py
from tf_tree_py.ros.messages.point_cloud import packed_cloud

pytestmark = pytest.mark.usefixtures('installed')


def test_setting_returns_nothing_as_in_tf2():
    import tf2_py
    import tf2_ros
    for cls in (tf2_py.BufferCore, tf2_ros.Buffer):
        buffer = cls()
        assert buffer.set_transform(transform('map', 'base', 1.0), 'somebody') is None
        assert buffer.set_transform_static(transform('base', 'camera'), 'somebody') is None
        assert buffer.can_transform_core('map', 'camera', at(1.0)) == (True, '')
    assert isinstance(buffer, tf2_py.BufferCore)
    assert isinstance(buffer, tf2_ros.BufferInterface)
    assert isinstance(buffer, tf_tree_py.Buffer)


def test_cache_time_is_the_first_argument():
    import tf2_py
    import tf2_ros
    for buffer in (tf2_ros.Buffer(Duration(seconds=2)), tf2_py.BufferCore(Duration(seconds=2))):
        for seconds in (1.0, 5.0, 6.0):
            buffer.set_transform(transform('map', 'base', seconds), 'somebody')
        assert not buffer.can_transform_core('map', 'base', at(1.0))[0]


def test_curve_is_an_edge_for_code_written_for_tf2():
    import tf2_ros
    buffer = tf2_ros.Buffer()
    buffer.insert_curve('map', 'base', tf_tree_py.ConstantTwist(
        10**9, 3 * 10**9, tf_tree_py.Pose(), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    buffer.set_transform_static(transform('base', 'camera', x=0.5), 'somebody')
    found = buffer.lookup_transform('map', 'camera', at(2.5))
    assert found.transform.translation.x == pytest.approx(2.0)
    assert buffer.can_transform('map', 'camera', at(3.0))
    with pytest.raises(tf2_ros.ExtrapolationException):
        buffer.lookup_transform('map', 'camera', at(3.5))


def test_time_of_rclpy_may_be_the_stamp_of_a_message():
    """It is not correct there, but tf2's bindings and tests accept it."""
    import tf2_ros
    buffer = tf2_ros.Buffer()
    for second in range(5):
        message = transform('map', 'base', w=1.0)
        message.header.stamp = Time(seconds=second)
        message.transform.translation.x = 3 * second
        buffer.set_transform(message, 'somebody')
    found = buffer.lookup_transform('map', 'base', Time(seconds=1, nanoseconds=500_000_000))
    assert found.transform.translation.x == 4.5
    (x, y, z), _ = buffer.lookupVelocityCore('base', 'map', Time(), Duration(seconds=4))
    assert (x, y, z) == pytest.approx((3.0, 0.0, 0.0))


def test_coroutine_can_be_driven_by_hand():
    import tf2_ros
    buffer = tf2_ros.Buffer()
    waiting = buffer.lookup_transform_async('map', 'base', at(1.0))
    assert waiting.send(None) is None
    buffer.set_transform(transform('map', 'base', 1.0, x=2.0), 'somebody')
    with pytest.raises(StopIteration) as ended:
        waiting.send(None)
    assert ended.value.value.transform.translation.x == 2.0


def test_messages_are_transformed():
    import tf2_geometry_msgs
    import tf2_ros
    buffer = tf2_ros.Buffer()
    upside_down = transform('a', 'b', 2.0, x=1.0)
    upside_down.transform.rotation = Quaternion(x=1.0, w=0.0)
    buffer.set_transform(upside_down, 'somebody')
    point = PointStamped(point=Point(x=1.0, y=2.0, z=3.0))
    point.header.frame_id = 'a'
    point.header.stamp = at(2.0).to_msg()
    found = buffer.transform(point, 'b', new_type=PointStamped).point
    assert (found.x, found.y, found.z) == pytest.approx((0.0, -2.0, -3.0))
    a_T_b = buffer.lookup_transform('a', 'b', at(2.0))
    for name, cls in (('point', PointStamped), ('vector3', Vector3Stamped), ('pose', Pose),
                      ('pose_stamped', PoseStamped), ('polygon_stamped', PolygonStamped),
                      ('pose_with_covariance_stamped', PoseWithCovarianceStamped)):
        assert type(getattr(tf2_geometry_msgs, f'do_transform_{name}')(cls(), a_T_b)) is cls
    from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_point
    assert do_transform_point is tf2_geometry_msgs.do_transform_point


def test_clouds_are_transformed():
    import tf2_sensor_msgs
    a_T_b = transform('a', 'b', x=1.0)
    moved = tf2_sensor_msgs.transform_points([[1.0, 2.0, 3.0]], a_T_b.transform)
    assert moved.tolist() == [[2.0, 2.0, 3.0]]
    cloud = tf2_sensor_msgs.do_transform_cloud(packed_cloud(
        Header(frame_id='b'), {name: np.array([3.0]) for name in 'xyz'}, is_dense=True), a_T_b)
    assert cloud.header.frame_id == 'a'
    assert tf_tree_py.as_points(cloud).tolist() == [[4.0, 3.0, 3.0]]


def test_own_type_is_registered_as_in_tf2():
    import tf2_ros

    class Thing:
        """A user-defined type."""

    tf2_ros.TransformRegistration().add(Thing, lambda thing, transform: transform)
    buffer = tf2_ros.Buffer()
    buffer.set_transform(transform('a', 'b', 1.0), 'somebody')
    thing = tf2_ros.Stamped(Thing(), at(1.0).to_msg(), 'b')
    assert isinstance(buffer.transform(thing, 'a'), TransformStamped)


class OwnInterface:
    """A mixin for tf2's interface, in programs with their own buffer."""

    def __init__(self):
        super().__init__()
        self.registration = 'theirs'


def test_registration_may_be_replaced():
    import tf2_ros
    cls = type('Own', (OwnInterface, tf2_ros.BufferInterface), {})
    assert cls().registration == 'theirs'
    with pytest.raises(tf2_ros.NotImplementedException):
        cls().lookup_transform('a', 'b', Time())


def test_client_asks_a_server(make_node, spin):
    import tf2_ros
    serving = make_node('serving')
    buffer = tf2_ros.Buffer()
    buffer.set_transform(transform('map', 'base', 1.0), 'somebody')
    with (tf_tree_py.BufferServer(buffer, serving),
          tf2_ros.BufferClient(make_node('client'), 'tf2_buffer_server') as client):
        spin(serving)
        assert client.wait_for_server(PATIENCE)
        assert client.can_transform('map', 'base', at(1.0), lasting(1.0))
        with pytest.raises(tf2_ros.LookupException):
            client.lookup_transform('map', 'nowhere', at(1.0))


def test_client_takes_the_answers_of_a_server_made_by_hand(make_node, spin):
    """As in tests of programs: services that accept, and do not set the status."""
    import tf2_ros
    serving = make_node('serving')
    action = LookupTransform.Impl

    def accept(request, response):
        response.accepted = True
        return response

    def answer(request, response):
        response.result.transform = transform('map', 'base', 1.0, x=2.0)
        return response

    serving.create_service(action.SendGoalService, '/mine/_action/send_goal', accept)
    serving.create_service(action.GetResultService, '/mine/_action/get_result', answer)
    with tf2_ros.BufferClient(make_node('client'), 'mine', timeout_padding=0.0) as client:
        spin(serving)
        found = client.lookup_transform('map', 'base', Time(), PATIENCE)
        assert found.transform.translation.x == 2.0
