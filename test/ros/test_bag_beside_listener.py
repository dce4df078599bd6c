# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag opens as the buffer that a listener fills from the same messages, over real DDS."""

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_helpers import until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, CovarianceListener, load, TransformListener, UNLIMITED
from tf_tree_py.bag import Covariances, open_bag
from tf_tree_py.beyond.uncertainty.covariance_history import EdgeCovariances
from tf_tree_py.core import Kind

bags = pytest.importorskip('bags', reason='rosbags is not installed', exc_type=ImportError)

# The number of messages by which a listener can fall behind before a middleware may drop some.
AT_A_TIME = 50
KEEPS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


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


# The messages contain every anomaly on purpose.
pytestmark = pytest.mark.filterwarnings('ignore::tf_tree_py.bag.BagWarning')


@pytest.fixture
def heard(node, talker, listen):
    """Return a buffer that a listener filled."""
    buffer = listen(node, Buffer(cache_time=UNLIMITED))
    static = talker.node.create_publisher(TFMessage, '/tf_static', KEEPS)

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
        ours = open_bag(path)
        bags.assert_same(ours, heard.snapshot())
        assert ours.statistics.accepted == theirs.accepted
        assert ours.statistics.refused == theirs.refused > 300

    heard.record(tmp_path / 'incident.mcap')
    heard.save(tmp_path / 'incident.tftree')
    recorded, saved = open_bag(tmp_path / 'incident.mcap'), load(tmp_path / 'incident.tftree')
    for stamp in range(bags.START, bags.START + 5 * bags.SECOND, bags.SECOND // 11):
        wanted = heard.lookup_tree('base', stamp)
        assert recorded.lookup_tree('base', stamp) == wanted
        assert saved.lookup_tree('base', stamp) == wanted


# --- covariances

RULES = {
    '/amcl_pose': {'child': 'base', 'edge': ('map', 'odom')},
    '/odometry': {'planar': True},
    '/lidar_odometry': {'child': 'lidar', 'with_poses': True},
}
COUNT = 40

# The poses of the lidar come from a separate topic.
RUN = [message._replace(transforms=[each for each in message.transforms if each[1] != 'lidar'])
       for message in bags.RUN]


def covariances():
    """Return three messages with covariances at each of several moments, and a static one."""
    rng = np.random.default_rng(11)

    def estimated(topic, parent, child, number, **options):
        square = rng.normal(size=(6, 8)) * 0.02
        # Two of ten covariances are unusable.
        covariance = {3: np.zeros((6, 6)), 7: -np.eye(6)}.get(number % 10, square @ square.T)
        stamp = bags.START + number * 3 * bags.PERIOD + 1_234_567
        return bags.estimate(topic, parent, child, stamp, bags.random_pose(rng), covariance,
                             **options)

    return [message for number in range(COUNT) for message in (
        estimated('/amcl_pose', 'map' if number % 13 else 'world', '', number),
        estimated('/odometry', '/odom', 'base', number),
        estimated('/lidar_odometry', 'odom', 'scan', number))] + [
            estimated('/tf_static_covariance', 'base', 'camera', 1, qos=bags.LATCHED)]


COVARIANCES = covariances()


@pytest.fixture
def heard_covariances(node, talker):
    """Return a buffer whose listener received the messages, after the transforms were inserted."""
    buffer = Buffer(cache_time=UNLIMITED)
    for message in RUN:
        for sample in message.transforms:
            buffer.insert(*sample, static=message.topic == '/tf_static')
    with CovarianceListener(buffer, node) as beside, TransformListener(buffer, node) as listener:
        publishers = {}
        for topic, rules in RULES.items():
            cls = PoseWithCovarianceStamped if topic == '/amcl_pose' else Odometry
            if 'with_poses' in rules:
                listener.subscribe(cls, topic, child=rules['child'], covariances=True,
                                   qos=QoSProfile(depth=100))
            else:
                beside.subscribe(cls, topic, qos=QoSProfile(depth=100), **rules)
            publishers[topic] = talker.node.create_publisher(cls, topic, 100)
            talker.until_heard(publishers[topic])
        publishers['/tf_static_covariance'] = talker.node.create_publisher(
            Odometry, '/tf_static_covariance', KEEPS)
        for message in COVARIANCES:
            publishers[message.topic].publish(message.data)
        until(lambda: taken(buffer) == len(COVARIANCES))
    return buffer


def taken(buffer):
    """Return the number of messages that became covariances or were refused."""
    known = buffer.snapshot()._tree.companion_or_new(EdgeCovariances).by_edge.values()
    counts = buffer.statistics()
    return sum(map(len, known)) + counts.refused + counts.incidents[Kind.POSE_ALONE]


def test_every_uncertain_lookup_is_that_of_a_buffer_which_listened(
        heard_covariances, tmp_path):
    ours = open_bag(bags.write_ros2(tmp_path / 'run', [*RUN, *COVARIANCES]), covariances={
        topic: Covariances(**rules) for topic, rules in RULES.items()})
    assert ours.statistics.incidents == heard_covariances.statistics().incidents
    assert ours.statistics.incidents[Kind.BAD_COVARIANCE] > COUNT // 3
    assert ours.statistics.incidents[Kind.POSE_ALONE] > COUNT // 8
    there = heard_covariances.snapshot()
    assert len(there.lookup_budget('map', 'camera', bags.START + bags.SECOND)) == 3
    stamps = np.arange(bags.START + bags.SECOND // 10, bags.START + 2 * bags.SECOND,
                       bags.SECOND // 23)
    for target, source in (('map', 'odom'), ('map', 'camera'), ('lidar', 'camera'),
                           ('odom', 'lidar')):
        for mine, theirs in zip(ours.lookup_uncertain_many(target, source, stamps),
                                there.lookup_uncertain_many(target, source, stamps),
                                strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-15)
            assert theirs.any()
