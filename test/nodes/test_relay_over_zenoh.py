# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A robot's transforms from DDS into Zenoh, and those of a fleet back onto topics."""

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
from tf_tree_py.core.arrivals.wire import write
from tf_tree_py.core.geometry.se3 import IDENTITY
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
    """Return what publishes on a robot: a broadcaster of what moves, and one of what does not."""
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


@pytest.fixture
def echo():
    """Return tf2's own program, looking for a robot's camera."""
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
        f'/robot8/tf -> hall3/robot8/tf, /tf_static -> hall3/robot8/tf_static, by way of {router}')
    robot[1].sendTransform(transform('base', 'camera', x=0.25))
    with Ears(router, '**') as ears:
        assert ears.wait_for('hall3/robot8/tf_static', len) == [[CAMERA]]
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_process_that_never_found_its_router_ends_with_ctrl_c(start):
    program = start('tf_relay', '--zenoh', 'tcp/127.0.0.1:9', '--robot', 'robot7')
    program.wait_for('no connection to tcp/127.0.0.1:9 yet, and tries go on')
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


@pytest.mark.parametrize(('parameters', 'sentence'), [
    ({'zenoh': 'tcp/127.0.0.1:9'}, 'which robot is this'),
    ({'zenoh': 'hall', 'robot': 'r'}, 'is no address of a router'),
    ({'zenoh': 'tcp/127.0.0.1:9', 'robot': 'r*'}, 'cannot be the name of a robot in keys'),
    ({'from_zenoh': 'tcp/127.0.0.1:9', 'robot': 'r'}, 'robot and from_zenoh do not go together'),
    ({'from_zenoh': 'tcp/127.0.0.1:9', 'robots': 'a//b'}, 'no robot of keys'),
    ({'zenoh_config': '/none', 'robot': 'r'}, '/none: there is no such configuration file'),
])
def test_relay_that_cannot_be_is_refused(context, parameters, sentence):
    with pytest.raises(BadInput, match=sentence):
        make_relay(context, **parameters)
