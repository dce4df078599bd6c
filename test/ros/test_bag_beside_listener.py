# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag opens as the buffer that a listener fills from the same messages, over real DDS."""

import warnings

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_helpers import until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, load, UNLIMITED
from tf_tree_py.bag import open_bag

bags = pytest.importorskip('bags', reason='rosbags is not installed', exc_type=ImportError)

# The number of messages by which a listener can fall behind before a middleware may drop some.
AT_A_TIME = 50


def pose():
    return bags.random_pose(bags.RNG)


def odd():
    """Yield edges with problems: late, repeated, refused, with a new parent, in a loop."""
    for number in range(120):
        stamp = bags.START + number * bags.SECOND // 20
        late = stamp - (number % 7 == 0) * bags.SECOND // 3
        yield [('map' if number % 40 < 20 else 'base', 'cup', stamp, pose())]
        yield [('base', 'wheel', late, pose()), ('hand', 'map', stamp, pose())]
        yield [('base', 'wheel', stamp, (0.0,) * 7), ('base', 'base', stamp, pose())]


MESSAGES = [bags.STATIC[0]._replace(received=bags.START), *bags.driving(), *(
    bags.Message(bags.START + 4 * bags.SECOND + number * bags.SECOND // 1000, '/tf', transforms)
    for number, transforms in enumerate(odd()))]


@pytest.fixture
def heard(node, talker, listen):
    """Return a buffer that a listener filled."""
    buffer = listen(node, Buffer(cache_time=UNLIMITED))
    keeps = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    static = talker.node.create_publisher(TFMessage, '/tf_static', keeps)

    def counted():
        statistics = buffer.statistics()
        return statistics.accepted + statistics.refused

    sent = 0
    for number, message in enumerate(MESSAGES):
        data = bags.as_cdr(message.transforms)
        if message.topic == '/tf_static':
            static.publish(data)
        else:
            talker.send(data)
        sent += len(message.transforms)
        if number % AT_A_TIME == 0:
            until(lambda sent=sent: counted() == sent)
    until(lambda: counted() == sent)
    return buffer


def test_every_lookup_is_that_of_a_buffer_which_listened(heard, tmp_path):
    for path in (bags.write_ros2(tmp_path / 'run', MESSAGES),
                 bags.write_ros2(tmp_path / 'sqlite', MESSAGES, 'sqlite3'),
                 bags.write_ros1(tmp_path / 'run.bag', MESSAGES)):
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')
            opened = open_bag(path)
        bags.assert_same(opened, heard.snapshot())
        theirs = heard.statistics()
        assert opened.statistics.accepted == theirs.accepted
        assert opened.statistics.refused == theirs.refused > 300


def test_what_a_listening_buffer_holds_is_recorded(heard, tmp_path):
    heard.record(tmp_path / 'incident.mcap')
    heard.save(tmp_path / 'incident.tftree')
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        opened = open_bag(tmp_path / 'incident.mcap')
    for stamp in range(bags.START, bags.START + 5 * bags.SECOND, bags.SECOND // 11):
        wanted = heard.lookup_tree('base', stamp)
        assert opened.lookup_tree('base', stamp) == wanted
        assert load(tmp_path / 'incident.tftree').lookup_tree('base', stamp) == wanted
