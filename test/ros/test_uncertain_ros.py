# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Covariances and gyroscopes over real DDS, and the buffer's results as messages."""

import gc
import re

from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped, Twist
from inputs import for_each
from nav_msgs.msg import Odometry
import numpy as np
import pytest
from ros_helpers import (
    at,
    lasting,
    LATEST,
    PATIENCE,
    PATIENCE_S,
    receivers,
    transform,
    until,
    until_waiting,
)
from sensor_msgs.msg import Imu
from tf_tree_py import (
    Buffer,
    CovarianceListener,
    FutureExtrapolationException,
    GyroListener,
    InvalidArgumentException,
    Pose,
    screws,
)
from tf_tree_py.beyond.curves.aided import gyro_of
from tf_tree_py.beyond.uncertainty.covariances import composed
from tf_tree_py.beyond.uncertainty.insertion import insert_covariance
from tf_tree_py.core import Kind
from tf_tree_py.ros.messages.pose_covariances import pose_with_covariance_stamped, uncertain_values

SECOND = 10**9
COVARIANCE = np.diag([1e-4, 4e-4, 0.0, 0.0, 0.0, 1e-4])
TURNED = Pose.from_xyz_rpy(x=5.0, y=1.0, yaw=0.5)


@pytest.fixture
def buffer():
    """Return the buffer of a robot at 1 s and 2 s with a camera, without uncertainty."""
    buffer = Buffer()
    for seconds in (1, 2):
        buffer.insert('map', 'odom', seconds * SECOND, Pose(y=2.0))
        buffer.insert('odom', 'base', seconds * SECOND, Pose.from_xyz_rpy(x=seconds, yaw=0.3))
    buffer.insert('base', 'camera', 0, Pose(x=0.2, z=1.0), static=True)
    return buffer


def stamped(seconds=1.5, covariance=COVARIANCE, pose=TURNED, frame='map'):
    return pose_with_covariance_stamped(frame, round(seconds * SECOND), pose, np.array(covariance))


def odometry(seconds=1.5, covariance=COVARIANCE, parent='odom', child='base', pose=TURNED):
    message = stamped(seconds, covariance, pose, parent)
    return Odometry(header=message.header, child_frame_id=child, pose=message.pose)


def send(talker, topic, *messages):
    publisher = talker.node.create_publisher(type(messages[0]), topic, 100)
    talker.until_heard(publisher)
    for message in messages:
        publisher.publish(message)


@pytest.fixture
def hear(buffer, make_node, talker):
    """Let a listener hear one message, until a function is true; it is closed afterwards."""
    node = make_node('robot', namespace='/robot1', use_global_arguments=False,
                     cli_args=['--ros-args', '-r', 'odometry:=wheels'])

    def hear(message, until_this, topic='odometry', sent_on='/robot1/wheels', **options):
        with CovarianceListener(buffer, node) as listener:
            listener.subscribe(type(message), topic, **options)
            send(talker, sent_on, message)
            until(until_this)

    return hear


def covariance_of(buffer, target, source, seconds=1.5):
    return uncertain_values(buffer.lookup_uncertain(target, source, at(seconds)).pose)[1]


# --- in messages

def test_lookup_is_a_pose_with_covariance_and_waits_for_its_data(buffer, pool):
    buffer.insert('odom', 'base', 2 * SECOND, Pose(x=2.0), covariance=COVARIANCE)
    message = buffer.lookup_uncertain('odom', 'camera', LATEST)
    assert message.header.frame_id == 'odom' and message.header.stamp == at(2.0).to_msg()
    pose, covariance = uncertain_values(message.pose)
    assert pose == pytest.approx(buffer.lookup('odom', 'camera'))
    assert covariance[1, 1] == pytest.approx(4e-4 + 0.2 ** 2 * 1e-4)
    poses, covariances = buffer.lookup_uncertain_many('odom', 'camera', [at(2.0)])
    np.testing.assert_allclose(covariances[0], covariance)
    (share,) = buffer.lookup_budget('odom', 'camera', at(2.0))
    assert (share.parent, share.child, share.position) == ('odom', 'base', 1.0)

    between = 'base', at(2.0), 'camera', at(3.0), 'odom'
    found = pool.submit(buffer.lookup_uncertain, 'odom', 'camera', at(3.0), PATIENCE)
    found_between = pool.submit(buffer.lookup_uncertain_full, *between, PATIENCE)
    until_waiting(buffer, 2)
    buffer.insert('odom', 'base', 3 * SECOND, Pose(x=3.0))
    assert uncertain_values(found.result().pose)[1].any()
    message = found_between.result()
    assert message.header.frame_id == 'base' and message.header.stamp == at(2.0).to_msg()
    pose, covariance = uncertain_values(message.pose)
    assert pose == pytest.approx(buffer.lookup_full(*between))
    # The last covariance holds at both stamps: it is one error, and the base did not rotate.
    assert covariance[0, 0] == pytest.approx(0.0, abs=1e-12)
    poses, joint = buffer.lookup_joint('odom', ['base', 'camera'], at(2.0))
    assert poses.shape == (2, 7) and joint[0, 6] == pytest.approx(joint[0, 0]) != 0.0
    with pytest.raises(FutureExtrapolationException):
        buffer.lookup_uncertain('odom', 'camera', at(4.0))


def test_lookup_waits_until_the_noise_is_learnt(pool):
    rng, buffer = np.random.default_rng(1), Buffer()

    def insert(numbers):
        for number in numbers:
            buffer.insert('odom', 'base', number * SECOND // 50, Pose(x=rng.normal(scale=0.01)))

    insert(range(1, 10))
    found = pool.submit(buffer.lookup_uncertain, 'odom', 'base', LATEST, PATIENCE,
                        learnt_noise=True)
    until_waiting(buffer, 1)
    insert(range(10, 100))
    covariance = uncertain_values(found.result().pose)[1]
    assert 0.002 < np.sqrt(covariance[0, 0]) < 0.03 and not covariance[3:].any()
    assert buffer.edge_noise('base').trials > 50


def test_prediction_is_marked(buffer):
    found = buffer.predict('odom', 'camera', at(2.25), lasting(0.5))
    assert found.beyond == lasting(0.25)
    assert found.pose.header.stamp == at(2.25).to_msg()
    assert found.pose.pose.pose.position.x == pytest.approx(
        buffer.lookup('odom', 'camera').x + 0.25)
    assert found.pose.pose.covariance[0] > 0.0
    wider = buffer.predict('odom', 'camera', at(2.25), lasting(0.5), acceleration={
        'base': (30.0, 0.0, 0.0, 0.0, 0.0, 0.0)}).pose
    assert wider.pose.covariance[0] > 4.0 * found.pose.pose.covariance[0]
    assert buffer.predict('odom', 'camera', at(1.5), lasting(0.5)).beyond == lasting(0)
    with pytest.raises(FutureExtrapolationException, match='prediction, 500 ms'):
        buffer.predict('odom', 'camera', at(2.75), lasting(0.5))


def test_prediction_takes_the_twist_that_was_commanded(buffer):
    command = Twist()
    command.linear.x, command.angular.z = 0.8, 0.1
    for twist in (command, (0.8, 0.0, 0.0, 0.0, 0.0, 0.1)):
        found = buffer.predict('odom', 'base', at(2.5), lasting(0.5), twist={'base': twist})
        moved = buffer.lookup('odom', 'base') @ Pose._make(screws.exp(
            (0.4, 0.0, 0.0, 0.0, 0.0, 0.05)))
        assert found.pose.pose.pose.position.x == pytest.approx(moved.x)
        assert found.pose.pose.pose.position.y == pytest.approx(moved.y)
    with pytest.raises(InvalidArgumentException, match='twist 3: it maps child frames'):
        buffer.predict('odom', 'base', at(2.5), lasting(0.5), twist=3)


def test_uncertainty_of_the_way_is_added_on_demand(buffer):
    way = 1e-4 * np.eye(6)
    insert_covariance(buffer.intake, 'odom', 'base', SECOND, way, 'test')
    detection = stamped(pose=Pose(z=3.0), frame='camera')
    plain = buffer.transform(detection, 'odom')
    added = buffer.transform(detection, 'odom', uncertain=True)
    assert added.header == plain.header
    np.testing.assert_allclose(uncertain_values(added.pose)[0], uncertain_values(plain.pose)[0])
    camera, of_camera = uncertain_values(
        buffer.lookup_uncertain('odom', 'camera', at(1.5)).pose)
    np.testing.assert_allclose(uncertain_values(added.pose)[1],
                               composed(camera, of_camera, Pose(z=3.0), COVARIANCE))
    assert added.pose.covariance[0] > plain.pose.covariance[0] + 1e-4
    with pytest.raises(TypeError, match='takes a PoseWithCovarianceStamped.* not PointStamped'):
        buffer.transform(PointStamped(), 'odom', uncertain=True)


# --- topics

def test_odometry_tells_of_the_edge_between_its_frames(buffer, hear):
    before = buffer.lookup('odom', 'base', at(1.5))
    hear(odometry(), lambda: covariance_of(buffer, 'odom', 'base').any())
    np.testing.assert_allclose(covariance_of(buffer, 'odom', 'base'), COVARIANCE)
    # Its pose is not used: that comes on /tf.
    assert buffer.lookup('odom', 'base', at(1.5)) == before


AMCL = {'topic': 'amcl_pose', 'sent_on': '/robot1/amcl_pose', 'child': 'base',
        'edge': ('map', 'odom')}


def test_localisation_is_as_unsure_of_the_robot_as_it_says(buffer, hear):
    """The uncertain edge is map -> odom; the robot in map must have the covariance as sent."""
    robot = buffer.lookup('map', 'base', at(1.5))
    hear(stamped(pose=robot), lambda: covariance_of(buffer, 'map', 'odom').any(), **AMCL)
    np.testing.assert_allclose(covariance_of(buffer, 'map', 'base'), COVARIANCE, atol=1e-12)
    assert not covariance_of(buffer, 'odom', 'base').any()
    assert covariance_of(buffer, 'map', 'odom')[1, 1] > 6e-4


def test_localisation_that_is_ahead_of_the_transforms_is_kept(buffer, hear):
    def catch_up():
        until_waiting(buffer)
        for parent, child in (('map', 'odom'), ('odom', 'base')):
            buffer.insert(parent, child, 3 * SECOND, Pose(x=1.0))
        until(lambda: covariance_of(buffer, 'map', 'base', 3.0).any())
        return True

    hear(stamped(3.0), catch_up, **AMCL)


UNKNOWN = np.diag([1e-4, 1e-4, 1e6, 1e6, 1e6, 1e-4])


def test_robot_on_a_floor_is_taken_without_what_its_driver_does_not_know(buffer, hear):
    hear(odometry(covariance=UNKNOWN), lambda: covariance_of(buffer, 'odom', 'base').any(),
         planar=True)
    np.testing.assert_allclose(covariance_of(buffer, 'odom', 'base'),
                               np.diag([1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-4]))


@pytest.mark.parametrize(('covariance', 'edge', 'sentence'), [
    (UNKNOWN, None, r'variance of a rotation is 1e\+06 rad\^2.*planar=True'),
    (np.zeros((6, 6)), None, 'all zero: the sender did not set it'),
    (COVARIANCE, ('map', 'odom'), "a pose in 'odom', which is not the parent of the edge"),
])
def test_what_cannot_be_used_is_counted_and_told(covariance, edge, sentence, buffer, hear, log):
    hear(odometry(covariance=covariance),
         lambda: buffer.statistics().incidents[Kind.BAD_COVARIANCE], edge=edge)
    assert not covariance_of(buffer, 'odom', 'base').any()
    until(lambda: "'odom' -> 'base' from '/robot1/wheels' (unusable covariance)" in log())
    assert re.search(sentence, log())


@for_each(subscription_and_sentence=[
    (Imu, {}, 'neither Odometry nor PoseWithCovarianceStamped'),
    (PoseWithCovarianceStamped, {}, 'pass child='),
    (Odometry, {'edge': ('a', 'b', 'c')}, 'edge is .parent, child.'),
])
def test_options_that_do_not_fit_together_are_refused(subscription_and_sentence, buffer, node):
    cls, options, sentence = subscription_and_sentence
    with CovarianceListener(buffer, node) as listener, pytest.raises(ValueError, match=sentence):
        listener.subscribe(cls, 'topic', **options)
    for limits in ({'max_gap': lasting(0.0)}, {'saturation': 0.0}, {'saturation': float('nan')}):
        with pytest.raises(ValueError, match='positive'):
            GyroListener(buffer, node, 'base', **limits)


def hear_turning(buffer, node, talker, roll, **limits):
    """Let a buffer hear a gyroscope that turns right until 1.5 s, then left, at 1 rad/s."""
    buffer.insert('base', 'imu', 0, Pose.from_xyz_rpy(roll=roll), static=True)
    with GyroListener(buffer, node, 'base', 'imu', **limits):
        messages = []
        for number in range(18, 43):
            messages.append(Imu(header=transform('imu', '', number / 20).header))
            messages[-1].angular_velocity.z = -1.0 if number < 30 else 1.0
        send(talker, '/imu', *messages)

        def came():
            gyro = gyro_of(buffer._tree.histories['base'])
            return gyro is not None and gyro.orientations.newest_stamp >= 2 * SECOND

        until(came)


def test_gyroscope_aids_the_edge_in_the_axes_of_its_child(buffer, node, talker):
    # Upside down: its rate about its z rotates the robot in the other direction.
    hear_turning(buffer, node, talker, np.pi)
    found = buffer.lookup('odom', 'base', at(1.5))
    assert found.as_rpy()[2] == pytest.approx(0.3 + 0.5, abs=0.05)
    assert buffer.lookup('odom', 'base', at(2.0)).as_rpy()[2] == pytest.approx(0.3)


@pytest.mark.parametrize('limits', [{'max_gap': lasting(0.04)}, {'saturation': 1.0}])
def test_holes_of_the_gyroscope_are_those_of_its_limits(limits, buffer, node, talker):
    plain = buffer.lookup('odom', 'base', at(1.5))
    # Rotated by 45 degrees, so that no axis of the child has the full rate of a sensor's axis.
    hear_turning(buffer, node, talker, np.pi / 4, **limits)
    assert buffer.lookup('odom', 'base', at(1.5)) == plain


def test_gyroscope_whose_place_on_the_robot_is_unknown_is_told(buffer, node, talker, log):
    with GyroListener(buffer, node, 'base'):
        send(talker, '/imu', Imu(header=transform('loose', '', 1.0).header))
        until(lambda: 'A message of the gyroscope cannot be used: "loose" passed to' in log())


@pytest.mark.parametrize('make', [CovarianceListener, lambda *both: GyroListener(*both, 'base')])
def test_listener_ends_when_it_is_let_go_or_closed(make, buffer, node):
    listener = make(buffer, node)
    (thread,) = receivers()
    del listener
    gc.collect()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()
    listener = make(buffer, node)
    listener.close()
    listener.close()
    assert not receivers()


def test_times_of_ros_are_stamps_everywhere(buffer):
    assert buffer.aid('base', [at(1.0), at(1.1)], np.zeros((2, 3))) == 2
    assert buffer.lookup_budget('odom', 'base', at(1.5)) == []
    assert buffer.predict('odom', 'base', LATEST, lasting(1.0)).pose.header.stamp.sec == 2
