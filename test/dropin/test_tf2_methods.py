# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Methods that only the drop-in's buffers have, and tf2's tools and some programs call."""

import json

from dropin_helpers import run
from inputs import for_each
import pytest
from rclpy.clock_type import ClockType
from rclpy.time import Time
from ros_helpers import FAR_STAMPS, lasting, Moment, transform, with_a_lamp
from standin import run_with_tf2
import tf_tree_py
from tf_tree_py import InvalidArgumentException, Pose, TransformException
from tf_tree_py.dropin.buffer import Buffer


def chain(buffer, time, *, target='map', source='base', fixed='map'):
    return buffer._chain(target, time, source, time, fixed)


def dot(buffer, time=None):
    return buffer._allFramesAsDot(time)


def knows(buffer, frame):
    return buffer._frameExists(frame)


def frames(buffer):
    return buffer._getFrameStrings()


METHODS = {
    'lookupVelocityCore': lambda buffer, time: buffer.lookupVelocityCore(
        'map', 'base', time, lasting(0.1)),
    'lookupVelocityFullCore': lambda buffer, time: buffer.lookupVelocityFullCore(
        'map', 'base', 'base', (1.0, 2.0, 3.0), 'map', time, lasting(0.1)),
    '_chain': chain,
    '_allFramesAsDot': dot,
    '_frameExists': lambda buffer, time: knows(buffer, 'map'),
    '_getFrameStrings': lambda buffer, time: frames(buffer),
}


@pytest.fixture
def buffer():
    return with_a_lamp(Buffer())


def test_chain_goes_over_the_fixed_frame(buffer):
    at = Time(seconds=2)
    for fixed, between in (('map', ['odom', 'map', 'odom']), ('lamp', ['odom'])):
        assert chain(buffer, at, target='lamp', source='arm', fixed=fixed) == [
            'arm', 'base', *between, 'lamp']


def test_frames_are_told_apart_from_names_nobody_knows(buffer):
    assert knows(buffer, 'lamp')
    assert not knows(buffer, 'nowhere')
    assert frames(buffer) == ['odom', 'map', 'base', 'arm', 'lamp']


def test_graph_has_an_arrow_for_each_edge(buffer):
    graph = dot(buffer)
    assert graph.startswith('digraph G {') and graph.endswith('}\n')
    assert '"odom" -> "lamp" [label="Broadcaster: test\\nAverage rate: 1.000 Hz' in graph
    assert graph.count('->') == 4


@pytest.mark.parametrize('name', METHODS)
def test_our_own_buffer_has_none_of_them(name):
    assert hasattr(Buffer, name)
    assert not hasattr(tf_tree_py.Buffer, name)


@pytest.mark.parametrize('name', ['lookupVelocityCore', 'lookupVelocityFullCore', '_chain'])
def test_steady_time_is_refused_here_too(name):
    buffer = Buffer()
    for second in range(1, 20):
        buffer.set_transform(transform('map', 'base', second), 'me')
    METHODS[name](buffer, Time(seconds=10, clock_type=ClockType.ROS_TIME))
    with pytest.raises(InvalidArgumentException, match='counts from when the machine started'):
        METHODS[name](buffer, Time(seconds=10, clock_type=ClockType.STEADY_TIME))


@for_each(name=METHODS, stamp=FAR_STAMPS)
def test_far_stamp_gets_an_answer_or_an_error_of_ours(name, stamp):
    buffer = Buffer(lasting(10**9))
    for moment in (stamp - 5 * 10**8, stamp, stamp + 5 * 10**8):
        buffer.insert('map', 'base', moment, Pose())
    try:
        assert METHODS[name](buffer, Moment(stamp)) is not None
    except TransformException as error:
        assert 'extrapolation' in str(error)


LISTS_FRAMES = """
    from geometry_msgs.msg import TransformStamped
    import tf2_ros

    buffer = tf2_ros.Buffer()
    for parent, child in ('map', 'odom'), ('odom', 'base'), ('base', 'arm'), ('island', 'tree'):
        edge = TransformStamped(child_frame_id=child)
        edge.header.frame_id, edge.header.stamp.sec = parent, 1
        edge.transform.rotation.w = 1.0
        (buffer.set_transform_static if child == 'arm' else buffer.set_transform)(edge, 'me')
    print(buffer.all_frames_as_string())
    buffer.clear()
    print(buffer.all_frames_as_string())
"""


def test_frames_are_listed_as_by_tf2_also_after_a_clear(program):
    ours = run('-m', 'tf_tree_py.dropin', '--force', program(LISTS_FRAMES))
    assert ours.stdout == run_with_tf2(LISTS_FRAMES)
    assert 'Frame base exists with parent NO_PARENT.' in ours.stdout, ours.stderr


LATEST_COMMON_TIMES = """
    from geometry_msgs.msg import TransformStamped
    import tf2_ros

    buffer = tf2_ros.Buffer()
    for parent, child in ('map', 'odom'), ('island', 'hut'):
        edge = TransformStamped(child_frame_id=child)
        edge.header.frame_id, edge.header.stamp.sec = parent, 5
        buffer.set_transform(edge, 'me')
    for frames in ('map', 'odom'), ('odom', 'hut'), ('map', 'nowhere'), ('/map', 'odom'):
        try:
            print(buffer.get_latest_common_time(*frames))
        except tf2_ros.TransformException as error:
            print(type(error).__name__)
"""


def test_latest_common_time_raises_the_classes_of_tf2(program):
    ours = run('-m', 'tf_tree_py.dropin', '--force', program(LATEST_COMMON_TIMES))
    assert ours.stdout.splitlines()[1:] == [
        'TransformException', 'LookupException', 'InvalidArgumentException'], ours.stderr
    assert ours.stdout == run_with_tf2(LATEST_COMMON_TIMES)


def test_chain_of_tf2_lacks_frames():
    """As docs/deviations.md states about tf2's: it ends before the fixed frame, or has gaps."""
    said = json.loads(run_with_tf2("""
        import json
        from geometry_msgs.msg import TransformStamped
        from rclpy.time import Time
        import tf2_ros

        buffer = tf2_ros.Buffer()
        edges = ('map', 'odom'), ('odom', 'base'), ('base', 'arm'), ('odom', 'lamp')
        for parent, child in edges:
            edge = TransformStamped(child_frame_id=child)
            edge.header.frame_id = parent
            edge.transform.rotation.w = 1.0
            buffer.set_transform_static(edge, 'me')
        one, other = Time(seconds=1), Time(seconds=2)
        print(json.dumps([
            buffer._chain('lamp', one, 'arm', one, 'map'),
            buffer._chain('lamp', one, 'arm', other, 'map'),
            buffer._chain('lamp', one, 'arm', one, 'lamp'),
        ]))
    """))
    assert said == [['arm', 'base', 'odom'], ['arm', 'map', 'odom', 'lamp'],
                    ['arm', 'base', 'odom', 'lamp']]
