# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Odd frame names, by every way into a buffer, beside tf2's own buffer."""

from inspect import getsource
from itertools import product
import json

import bags
from geometry_msgs.msg import TransformStamped
import pytest
from rclpy.serialization import serialize_message
from rclpy.time import Time
from ros_helpers import until
from standin import run_with_tf2
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, StaticTransformBroadcaster, TransformBroadcaster
from tf_tree_py.bag import open_bag
from tf_tree_py.core.messages.wire import WireReader
from tf_tree_py.dropin import buffer as dropin
from tf_tree_py.ros.topics.qos import static_listener_qos

BODIES = ['', 'a', 'a/b', 'a//b', 'a/', ' a', 'a ', '/ a', '~a', 'A', 'é', 'a\tb', 'a b', '.',
          '..', 'map', '日本', "a'b", 'a"b', 'a\\b', 'x' * 300]
CHILDREN = [slashes + body for slashes, body in product(['', '/', '//', '///'], BODIES)]
PARENTS = ['map', '/map', '//map', '', '/', '//', 'a/b']
CASES = list(product(PARENTS, CHILDREN, [False, True]))
SECOND = 1_000_000_000
HERE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

# In an order in which each comes after its subclasses, in tf2 and here.
ERRORS = ['InvalidArgumentException', 'ConnectivityException', 'ExtrapolationException',
          'LookupException']


def forms(name):
    """Return a name, and what is left of it without its first slashes."""
    return [name, name.removeprefix('/'), name.lstrip('/')]


def answers(buffer, parent, child, time):
    """Return the kind of error of lookups with all forms of both names, or 'found'."""
    found = []
    for target, source in product(forms(parent), forms(child)):
        try:
            buffer.lookup_transform(target, source, time)
            found.append('found')
        except Exception as error:  # noqa: B902 - the classes are compared
            names = [cls.__name__ for cls in type(error).__mro__]
            found.append(next((name for name in ERRORS if name in names), names[0]))
    return found


IN_TF2 = f"""
import json, sys
from itertools import product
from geometry_msgs.msg import TransformStamped
from rclpy.time import Time
import tf2_ros

ERRORS = {ERRORS}
{getsource(forms)}
{getsource(answers)}
def answered(parent, child, static):
    buffer, message = tf2_ros.Buffer(), TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp.sec = parent, 1
    message.transform.rotation.w = 1.0
    (buffer.set_transform_static if static else buffer.set_transform)(message, 'me')
    return answers(buffer, parent, child, Time(seconds=1))

print(json.dumps([answered(*case) for case in {CASES}]))
"""


def message_of(parent, child):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp.sec = parent, 1
    message.transform.rotation.w = 1.0
    return message


def inserted(parent, child, static):
    buffer = Buffer()
    buffer.insert(parent, child, SECOND, HERE, static=static, strict=False)
    return buffer


def set_by_message(cls):
    def fill(parent, child, static):
        buffer = cls()
        setter = buffer.set_transform_static if static else buffer.set_transform
        setter(message_of(parent, child), 'me')
        return buffer

    return fill


def received(parent, child, static):
    buffer, reader = Buffer(), WireReader(static=static)
    data = serialize_message(TFMessage(transforms=[message_of(parent, child)]))
    buffer.insert_batch(reader.read(data), 'me', static)
    return buffer


WAYS = {'insert': inserted, 'set_transform': set_by_message(Buffer),
        'drop-in': set_by_message(dropin.Buffer), 'wire': received}


@pytest.fixture(scope='module')
def of_tf2():
    """Return tf2's answers for all cases."""
    return dict(zip(CASES, json.loads(run_with_tf2(IN_TF2)), strict=True))


@pytest.mark.parametrize('way', WAYS)
def test_names_are_those_of_tf2_by_every_way_in(of_tf2, way):
    for (parent, child, static), expected in of_tf2.items():
        buffer = WAYS[way](parent, child, static)
        assert answers(buffer, parent, child, Time(seconds=1)) == expected, (parent, child, static)


class Recorded:
    """A bag with one transform, looked up as a buffer of ROS is."""

    def __init__(self, path, parent, child, static):
        self._buffer = open_bag(bags.write_ros2(path, [bags.Message(
            SECOND, '/tf_static' if static else '/tf', [(parent, child, SECOND, HERE)])]))

    def lookup_transform(self, target, source, time):
        return self._buffer.lookup(target, source, time.nanoseconds)


@pytest.mark.filterwarnings('ignore::tf_tree_py.bag.BagWarning')
@pytest.mark.parametrize('parent', ['map', '//map'])
def test_names_in_a_bag_are_those_of_tf2(of_tf2, tmp_path, parent):
    for number, (child, static) in enumerate(product(CHILDREN, [False, True])):
        buffer = Recorded(tmp_path / str(number), parent, child, static)
        assert answers(buffer, parent, child, Time(seconds=1)) == of_tf2[
            parent, child, static], (child, static)


@pytest.mark.parametrize(('cls', 'topic'), [
    (TransformBroadcaster, '/tf'), (StaticTransformBroadcaster, '/tf_static')])
def test_broadcaster_publishes_the_names_as_they_are(make_node, spin, cls, topic):
    heard, node = [], make_node('hearing')
    subscription = node.create_subscription(
        TFMessage, topic, heard.append, static_listener_qos())
    spin(node)
    broadcaster = cls(make_node('talking'), static_listener_qos())
    until(subscription.get_publisher_count)
    # Each child once, because a static broadcaster keeps one transform of each.
    children = {child.removeprefix('/'): child for child in CHILDREN}.values()
    sent = [message_of(PARENTS[number % len(PARENTS)], child)
            for number, child in enumerate(children)]
    broadcaster.sendTransform(sent)
    until(lambda: heard)
    assert heard[0].transforms == sent
