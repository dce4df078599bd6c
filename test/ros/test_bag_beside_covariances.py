# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag with covariances gives the same results as a listener of the same messages."""

import warnings

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_helpers import until
from tf_tree_py import Buffer, CovarianceListener, UNLIMITED
from tf_tree_py.core import Kind

bags = pytest.importorskip('bags', reason='rosbags is not installed', exc_type=ImportError)
bag = pytest.importorskip('tf_tree_py.bag')

RULES = {
    '/amcl_pose': {'child': 'base', 'edge': ('map', 'odom')},
    '/odometry': {'planar': True},
    '/lidar_odometry': {'child': 'lidar', 'with_poses': True},
}
COUNT = 40

# The poses of the lidar come from a separate topic.
RUN = [message._replace(transforms=[each for each in message.transforms if each[1] != 'lidar'])
       for message in bags.RUN]


def messages():
    """Return three messages with covariances at each of several moments, and one for good."""
    rng = np.random.default_rng(11)

    def told(topic, parent, child, number, **options):
        square = rng.normal(size=(6, 8)) * 0.02
        # Two of ten covariances are unusable.
        covariance = {3: np.zeros((6, 6)), 7: -np.eye(6)}.get(number % 10, square @ square.T)
        stamp = bags.START + number * 3 * bags.PERIOD + 1_234_567
        return bags.estimate(topic, parent, child, stamp, bags.random_pose(rng), covariance,
                             **options)

    return [message for number in range(COUNT) for message in (
        told('/amcl_pose', 'map' if number % 13 else 'world', '', number),
        told('/odometry', '/odom', 'base', number),
        told('/lidar_odometry', 'odom', 'scan', number))] + [
            told('/tf_static_covariance', 'base', 'camera', 1, qos=bags.LATCHED)]


MESSAGES = messages()


@pytest.fixture
def heard(node, talker):
    """Return a buffer whose listener received the messages, after the transforms were inserted."""
    buffer = Buffer(cache_time=UNLIMITED)
    for message in RUN:
        for sample in message.transforms:
            buffer.insert(*sample, static=message.topic == '/tf_static')
    with CovarianceListener(buffer, node) as listener:
        publishers = {}
        for topic, rules in RULES.items():
            kind = PoseWithCovarianceStamped if topic == '/amcl_pose' else Odometry
            listener.subscribe(kind, topic, qos=QoSProfile(depth=100), **rules)
            publishers[topic] = talker.node.create_publisher(kind, topic, 100)
            talker.until_heard(publishers[topic])
        publishers['/tf_static_covariance'] = talker.node.create_publisher(
            Odometry, '/tf_static_covariance',
            QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        for message in MESSAGES:
            publishers[message.topic].publish(message.data)
        until(lambda: taken(buffer) == len(MESSAGES))
    return buffer


def taken(buffer):
    """Return the number of messages that became covariances or were refused."""
    known = buffer.snapshot()._tree.uncertainty.values()
    return sum(map(len, known)) + buffer.statistics().refused


def test_every_uncertain_lookup_is_that_of_a_buffer_which_listened(heard, tmp_path):
    path = bags.write_ros2(tmp_path / 'run', [*RUN, *MESSAGES])
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        opened = bag.open_bag(path, covariances={
            topic: bag.Covariances(**rules) for topic, rules in RULES.items()})
    assert opened.statistics.incidents == heard.statistics().incidents
    assert opened.statistics.incidents[Kind.BAD_COVARIANCE] > COUNT // 2
    there = heard.snapshot()
    assert len(there.lookup_budget('map', 'camera', bags.START + bags.SECOND)) == 3
    stamps = np.arange(bags.START + bags.SECOND // 10, bags.START + 2 * bags.SECOND,
                       bags.SECOND // 23)
    for target, source in (('map', 'odom'), ('map', 'camera'), ('lidar', 'camera'),
                           ('odom', 'lidar')):
        for ours, theirs in zip(opened.lookup_uncertain_many(target, source, stamps),
                                there.lookup_uncertain_many(target, source, stamps),
                                strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-15)
            assert theirs.any()
