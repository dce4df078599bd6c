# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag opens as the buffer that a listener fills from the same messages, over real DDS."""

import warnings

import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_helpers import until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, load, UNLIMITED
from tf_tree_py.bag import open_bag

bags = pytest.importorskip('bags', reason='rosbags is not installed', exc_type=ImportError)

# The number of messages by which a listener can fall behind before a middleware may drop some.
AT_A_TIME = 50


def odd():
    """Yield edges with problems: late, repeated, refused, with a new parent, in a loop."""
    rng = np.random.default_rng(12)
    for number in range(120):
        stamp = bags.START + number * bags.SECOND // 20
        late = stamp - (number % 7 == 0) * bags.SECOND // 3
        cup, wheel, loop, itself = (bags.random_pose(rng) for _ in range(4))
        yield [('map' if number % 40 < 20 else 'base', 'cup', stamp, cup)]
        yield [('base', 'wheel', late, wheel), ('hand', 'map', stamp, loop)]
        yield [('base', 'wheel', stamp, (0.0,) * 7), ('base', 'base', stamp, itself)]


DRIVING = [message for message in bags.RUN if message.topic == '/tf']
MESSAGES = [bags.STATIC[0]._replace(received=bags.START), *DRIVING, *(
    bags.Message(bags.START + 4 * bags.SECOND + number * bags.SECOND // 1000, '/tf', transforms)
    for number, transforms in enumerate(odd()))]


def opened(path):
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        return open_bag(path)


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
    theirs = heard.statistics()
    for path in (bags.write_ros2(tmp_path / 'run', MESSAGES),
                 bags.write_ros2(tmp_path / 'sqlite', MESSAGES, 'sqlite3'),
                 bags.write_ros1(tmp_path / 'run.bag', MESSAGES)):
        ours = opened(path)
        bags.assert_same(ours, heard.snapshot())
        assert ours.statistics.accepted == theirs.accepted
        assert ours.statistics.refused == theirs.refused > 300

    heard.record(tmp_path / 'incident.mcap')
    heard.save(tmp_path / 'incident.tftree')
    recorded, saved = opened(tmp_path / 'incident.mcap'), load(tmp_path / 'incident.tftree')
    for stamp in range(bags.START, bags.START + 5 * bags.SECOND, bags.SECOND // 11):
        wanted = heard.lookup_tree('base', stamp)
        assert recorded.lookup_tree('base', stamp) == wanted
        assert saved.lookup_tree('base', stamp) == wanted
