# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One robot's transforms on the shared topics, in this process and from a separate one."""

from contextlib import contextmanager
import math
import threading

from programs import PATIENCE_S
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_helpers import transform, until, until_subscribed
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, StaticTransformBroadcaster, TransformBroadcaster, TransformListener
from tf_tree_py.core import Pose
from tf_tree_py.nodes import tf_relay
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.nodes.tf_relay import TfRelay
from tf_tree_py.ros.messages.convert import transform_stamped

SECOND = 1_000_000_000


class Robot:
    """The publishers of a robot, in the robot's namespace."""

    def __init__(self, context, name):
        self.node = Node('driver', context=context, namespace=name)
        self._moving = TransformBroadcaster(self.node, tf_topic='tf')
        self._fixed = StaticTransformBroadcaster(self.node, tf_static_topic='tf_static')
        self.fix = self._fixed.sendTransform

    def move(self, *transforms):
        """Publish, once there is a subscription."""
        self.send(TFMessage(transforms=transforms))

    def send(self, message):
        until(self._moving.pub_tf.get_subscription_count)
        self._moving.pub_tf.publish(message)


@pytest.fixture
def robots(context):
    robots = [Robot(context, name) for name in ('robot1', 'robot2')]
    yield robots
    for robot in robots:
        robot.node.destroy_node()


@pytest.fixture
def robot(robots):
    return robots[0]


def make_relay(context, robot='robot1', **parameters):
    parameters = {'frame_prefix': f'{robot}/', 'shared_frames': ['map'], **parameters}
    return TfRelay(context=context, namespace=robot, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])


@contextmanager
def relayed(*args, **parameters):
    """Relay a robot's transforms, once the relay's existing subscribers are connected."""
    relay = make_relay(*args, **parameters)
    until_subscribed(relay)
    with spun_in_background(relay):
        yield relay


def test_frames_come_out_under_the_prefix_and_shared_ones_do_not(context, robots, buffer):
    with relayed(context, 'robot1'), relayed(context, 'robot2'):
        for number, robot in enumerate(robots, start=1):
            robot.fix(transform('base', 'camera', x=0.25))
            robot.move(transform('map', '/odom', 3, x=10.0 * number),
                       transform('odom', 'base', 3, x=1.0))
        for name in ('robot1', 'robot2'):
            buffer.lookup_within(PATIENCE_S, 'map', f'{name}/camera', 3 * SECOND)
        assert buffer.lookup('robot1/base', 'robot2/camera', 3 * SECOND) == Pose(10.25)
        assert sorted(buffer.frames()) == ['map', *(
            f'{robot}/{frame}' for robot in ('robot1', 'robot2')
            for frame in ('base', 'camera', 'odom'))]


def test_numbers_come_out_as_they_came_in(context, robot, recorded):
    turned = Pose(0.1, -2e300, 3e-300, 0.5, -0.5, 0.5, -0.5)
    with relayed(context, frame_prefix='', tf_topic='/tf'):
        robot.move(transform_stamped('map', 'odom', 123_456_789_012, turned))
        until(lambda: recorded['/tf'])
    assert recorded['/tf'] == [[('map', 'odom', 123_456_789_012, turned)]]


def test_statics_of_several_publishers_are_one_latched_message(
        context, robot, recorded):
    other = StaticTransformBroadcaster(robot.node, tf_static_topic='tf_static')
    with relayed(context):
        robot.fix(transform('base', 'camera', x=1.0))
        until(lambda: recorded['/tf_static'])
        other.sendTransform(transform('base', 'lidar', x=2.0))
        robot.fix(transform('base', 'camera', x=3.0))
        both = {('robot1/camera', 3.0), ('robot1/lidar', 2.0)}
        until(lambda: {(sample.child, sample.pose[0])
                       for sample in recorded['/tf_static'][-1]} == both)
        late, node = Buffer(), Node('late', context=context)
        with TransformListener(late, node, static_only=True):
            assert late.lookup_within(PATIENCE_S, 'robot1/lidar', 'robot1/camera').x == 1.0
        node.destroy_node()


def test_burst_is_thinned_out_and_its_last_pose_arrives(context, robot, recorded):
    with relayed(context, rate_hz=2.0):
        for seconds in range(1, 101):
            robot.move(transform('odom', 'base', seconds), transform('odom', 'arm', 1))
        until(lambda: recorded['/tf'] and recorded['/tf'][-1][0].stamp == 100 * SECOND)
    assert [sample.stamp for sample in recorded['/tf'][0]] == [SECOND, SECOND]
    assert len(recorded['/tf']) < 20


def test_without_a_rate_everything_is_passed_on(context, robot, recorded):
    with relayed(context):
        for seconds in range(1, 101):
            robot.move(transform('odom', 'base', seconds))
        until(lambda: len(recorded['/tf']) == 100)
    assert [message[0].stamp // SECOND for message in recorded['/tf']] == list(range(1, 101))


def test_frames_have_rates_of_their_own_and_go_out_when_they_move(context, robot, recorded):
    with relayed(context, **{'rates.arm': 1, 'min_move': 0.5, 'max_silence': 3600.0}):
        for stamp in range(1, 101):
            robot.move(transform('map', 'odom', stamp, x=0.004 * stamp),
                       transform('odom', 'base', stamp, x=float(stamp)),
                       transform('base', 'arm', stamp, x=float(stamp)))
        until(lambda: recorded['/tf'] and recorded['/tf'][-1][-1].stamp == 100 * SECOND)
    went = [sample.child for message in recorded['/tf'] for sample in message]
    assert went.count('robot1/odom') == 1
    assert went.count('robot1/base') == 100
    assert 1 <= went.count('robot1/arm') < 20


def test_only_wanted_frames_are_passed_on(context, robot, recorded):
    with relayed(context, frame_filter=['map', 'odom', 'base']):
        robot.move(transform('base', 'leg'))
        robot.move(transform('map', 'odom'), transform('base', 'leg'), transform('odom', 'base'))
        until(lambda: recorded['/tf'])
    assert [[sample.child for sample in message] for message in recorded['/tf']] == [
        ['robot1/odom', 'robot1/base']]


def test_what_no_buffer_would_take_stays_here_and_the_log_says_why(
        context, robot, recorded, capfd):
    with relayed(context):
        robot.send(b'\0\1\0\0\xff\xff\xff\xff')
        robot.move(transform('', 'odom'), transform('base', 'base'))
        impossible = transform('odom', 'imu')
        impossible.header.stamp.nanosec = 2**32 - 1
        robot.move(impossible)
        robot.move(transform('odom', 'bent', x=math.nan), transform('odom', 'base'))
        until(lambda: recorded['/tf'])
    assert [[sample.child for sample in message] for message in recorded['/tf']] == [
        ['robot1/base']]
    told = capfd.readouterr().err
    for reason in ('malformed message', 'empty frame name', 'frame is its own parent', 'NaN',
                   'nanosec is 4294967295'):
        assert reason in told


def test_end_of_ros_ends_the_relay(context):
    others = {*threading.enumerate()}
    relay = make_relay(context, rate_hz=5.0)
    own = {*threading.enumerate()} - others
    assert own
    context.shutdown()
    relay.destroy_node()
    for thread in own:
        thread.join(PATIENCE_S)
        assert not thread.is_alive()


@pytest.mark.parametrize(('robot', 'parameters', 'sentence'), [
    ('/', {}, 'would receive its own output, because /tf.* is both.*__ns:=/robot1'),
    ('/', {'frame_prefix': ''}, 'the relay would receive its own output'),
    ('robot1', {'tf_topic': 'tf', 'frame_prefix': 'r/'},
     'would receive its own output, because /robot1/tf'),
    ('robot1', {'source_tf_topic': '/tf_static'},
     'would receive its own output, because /tf_static'),
    ('robot1', {'tf_topic': 'a b'}, "parameter tf_topic must be a topic name, not 'a b'"),
    ('robot1', {'tf_topic': ''}, "parameter tf_topic must be a topic name, not ''"),
    ('robot1', {'shared_frames': [1, 2]}, 'parameter shared_frames must be a list of strings'),
    ('robot1', {'rate_hz': -1.0}, 'parameter rate_hz must be a number from 0.0 to 1000.0'),
    ('robot1', {'rates.odom': 'fast'}, 'parameter rates.odom must be a number from 0.0 to'),
    ('robot1', {'rates': 20.0}, 'parameter rates must be a number for each name, such as'),
    ('robot1', {'max_silence': 0.0}, 'parameter max_silence must be a number from 0.001'),
])
def test_relay_that_cannot_be_is_refused(context, robot, parameters, sentence):
    with pytest.raises(BadInput, match=sentence):
        make_relay(context, robot, **parameters)


@pytest.mark.parametrize(('given', 'taken'), [
    ('[map, earth]', ['map', 'earth']), ('map', ['map']), ('[]', []), ("['']", [])])
def test_list_of_names_may_be_written_in_any_way(context, given, taken):
    relay = TfRelay(context=context, namespace='robot1', cli_args=[
        '--ros-args', '-p', f'shared_frames:={given}'])
    assert relay.get_parameter('shared_frames').value == taken
    relay.destroy_node()


def test_help_tells_every_parameter(capsys):
    with pytest.raises(SystemExit) as ended:
        tf_relay.main(['tf_relay', '--help'])
    assert ended.value.code == 0
    told = capsys.readouterr().out
    assert all(setting.name in told for setting in tf_relay.SETTINGS)


def test_process_passes_on_until_ctrl_c(start, robot, buffer):
    program = start('tf_relay', '--ros-args', '-r', '__ns:=/robot1', '-p', 'rate_hz:=50',
                    '-p', 'frame_prefix:=robot1/', '-p', 'shared_frames:=[map]')
    program.wait_for('/robot1/tf -> /tf, /robot1/tf_static -> /tf_static')
    robot.fix(transform('odom', 'camera', x=1.0))
    seconds = iter(range(1, 1_000_000))
    # There is no event for the connection of the relay's subscribers.
    until(lambda: 'robot1/odom' in buffer.frames() or robot.move(
        transform('map', 'odom', next(seconds), x=2.0)))
    assert buffer.lookup_within(PATIENCE_S, 'map', 'robot1/camera') == Pose(3.0)
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_process_that_would_hear_itself_says_so_in_one_sentence(start):
    program = start('tf_relay')
    assert program.end() == 2
    assert program.output.startswith('tf_relay: the relay would receive its own output')
    assert program.output.count('\n') == 1
