# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot's transforms from DDS to Zenoh, and those of a fleet back to topics."""

from contextlib import contextmanager, ExitStack
from importlib.util import find_spec
import itertools

from programs import PATIENCE_S
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from ros_helpers import transform, until
from tf2_echoes import Tf2Echo
from tf_tree_py import Buffer, StaticTransformBroadcaster, TransformBroadcaster, TransformListener
from tf_tree_py.core import Pose, Sample
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.wire import write
from tf_tree_py.fleet import RobotPublisher
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.nodes.tf_relay import TfRelay

pytestmark = pytest.mark.skipif(not find_spec('zenoh'), reason='eclipse-zenoh is not installed')
if find_spec('zenoh'):
    from fleet.ears import Ears
    from fleet.fleet_helpers import router_here, session_at

SECOND = 1_000_000_000
CAMERA = Sample('base', 'camera', SECOND, (0.25, *IDENTITY[1:]))


@pytest.fixture(scope='module')
def router():
    with router_here() as endpoint:
        yield endpoint


@pytest.fixture
def robot(context):
    """Return the publishers of a robot: broadcasters of moving and of static transforms."""
    node = Node('driver', context=context)
    yield TransformBroadcaster(node), StaticTransformBroadcaster(node)
    node.destroy_node()


@contextmanager
def relayed(context, namespace=None, **parameters):
    relay = make_relay(context, namespace, **parameters)
    with spun_in_background(relay):
        yield


def make_relay(context, namespace=None, **parameters):
    return TfRelay(context=context, namespace=namespace, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])


def test_what_moved_goes_out_thinned_and_statics_at_once(context, robot, router):
    moving, static = robot
    with relayed(context, zenoh=router, robot='robot7', min_move=0.5, max_silence=3600.0,
                 frame_filter=['odom', 'base', 'camera', 'arm']), Ears(router, 'robot7/*') as ears:
        static.sendTransform(transform('base', 'camera', x=0.25))
        assert ears.wait_for('robot7/tf_static', len) == [[CAMERA]]
        until(moving.pub_tf.get_subscription_count)
        for stamp in range(1, 51):
            moving.sendTransform([transform('odom', 'base', stamp, x=0.001 * stamp),
                                  transform('base', 'arm', stamp, x=float(stamp)),
                                  transform('base', 'secret', stamp)])
        messages = ears.wait_for('robot7/tf', lambda messages: messages and messages[-1][
            -1].stamp == 50 * SECOND)
    went = [(sample.child, sample.stamp // SECOND) for message in messages for sample in message]
    assert went == [('base', 1), *(('arm', stamp) for stamp in range(1, 51))]


def test_fleet_comes_out_on_the_topics_of_another_network(context, router, buffer):
    with relayed(context, from_zenoh=router, key_prefix='back', robots='robot1,*2'), \
            session_at(router) as session, ExitStack() as robots:
        for number, name in enumerate(('other', 'robot1', 'robot2')):
            sender = robots.enter_context(RobotPublisher(session, name, key_prefix='back'))
            sender.send_static(write([CAMERA]))
            sender.send(write([Sample('map', 'base', SECOND, (float(number), *IDENTITY[1:])),
                               Sample('earth', 'map', SECOND, IDENTITY)]))
        assert buffer.lookup_within(
            PATIENCE_S, 'robot1/camera', 'robot2/camera', SECOND) == Pose(1.0)
        assert sorted(buffer.frames()) == [
            'map', *(f'{robot}/{frame}' for robot in ('robot1', 'robot2')
                     for frame in ('base', 'camera'))]
        late = Node('late', context=context)
        with TransformListener(Buffer(), late, static_only=True) as listener:
            listener.buffer.lookup_within(PATIENCE_S, 'robot2/base', 'robot2/camera')
        late.destroy_node()


@pytest.mark.parametrize('own', ['', 'robot7/'])
def test_relay_loop_is_told_of_and_nothing_goes_round(context, robot, router, log, own):
    moving, static = robot
    hall = 'loop' + own.strip('/')
    stamps = itertools.count(1)

    def is_told():
        # One at a time, so that DDS loses none.
        moving.sendTransform(transform('map', f'{own}base', next(stamps)))
        return 'a relay of the fleet (--from-zenoh) publishes in' in log()

    with relayed(context, zenoh=router, robot='robot7', key_prefix=hall), \
            relayed(context, from_zenoh=router, key_prefix=hall), \
            Ears(router, f'{hall}/robot7/*') as ears:
        static.sendTransform(transform('base', 'camera'))
        until(is_told)
        moving.sendTransform(transform('map', f'{own}end', 1))
        messages = ears.wait_for(f'{hall}/robot7/tf', lambda messages: any(
            sample.child == f'{own}end' for message in messages for sample in message))
    went = [(sample.child, sample.stamp) for message in messages for sample in message]
    assert len(went) == len(set(went)) and {child for child, _ in went} == {
        f'{own}base', f'{own}end'}
    assert log().count('(--from-zenoh) publishes in') == 1


@pytest.fixture
def echo():
    """Return tf2's own program, looking up a robot's camera."""
    echo = Tf2Echo('map', 'robot7/camera', 20)
    yield echo
    echo.kill()


def test_tf2_echo_hears_a_robot_of_another_network(context, router, echo):
    driver = Node('driver', context=context, namespace='robot7')
    moving = TransformBroadcaster(driver, tf_topic='tf')
    static = StaticTransformBroadcaster(driver, tf_static_topic='tf_static')
    with relayed(context, zenoh=router, namespace='robot7', rate_hz=20.0), \
            relayed(context, from_zenoh=router, robots='robot7'):
        static.sendTransform(transform('base', 'camera', x=0.25))
        stamps = itertools.count(1)
        until(lambda: 'Translation: [2.250, 0.000' in echo.output or moving.sendTransform(
            transform('map', 'base', next(stamps), x=2.0)))
    driver.destroy_node()


def test_process_sends_by_its_options_and_ends_with_ctrl_c(start, robot, router):
    program = start('tf_relay', '--zenoh', router, '--key-prefix', 'hall3',
                    '--ros-args', '-r', '__ns:=/robot8', '-r', 'tf_static:=/tf_static')
    program.wait_for(
        f'/robot8/tf -> hall3/robot8/tf, /tf_static -> hall3/robot8/tf_static, through {router}')
    robot[1].sendTransform(transform('base', 'camera', x=0.25))
    with Ears(router, '**') as ears:
        assert ears.wait_for('hall3/robot8/tf_static', len) == [[CAMERA]]
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_process_that_never_found_its_router_ends_with_ctrl_c(start):
    program = start('tf_relay', '--zenoh', 'tcp/127.0.0.1:9', '--robot', 'robot7')
    program.wait_for('no connection to tcp/127.0.0.1:9 yet, retrying')
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


@pytest.mark.parametrize(('parameters', 'sentence'), [
    ({'zenoh': 'tcp/127.0.0.1:9'}, 'the name of this robot is missing'),
    ({'zenoh': 'hall', 'robot': 'r'}, 'is not the address of a router'),
    ({'zenoh': 'tcp/127.0.0.1:9', 'robot': 'r*'}, 'cannot be the name of a robot in Zenoh keys'),
    ({'from_zenoh': 'tcp/127.0.0.1:9', 'robot': 'r'},
     'robot and from_zenoh cannot be used together'),
    ({'from_zenoh': 'tcp/127.0.0.1:9', 'robots': 'a//b'}, 'cannot match a robot'),
    ({'zenoh_config': '/none', 'robot': 'r'}, '/none: there is no such configuration file'),
])
def test_relay_that_cannot_be_is_refused(context, parameters, sentence):
    with pytest.raises(BadInput, match=sentence):
        make_relay(context, **parameters)
