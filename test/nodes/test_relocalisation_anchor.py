# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Late poses in, map -> odom out: over DDS, and from a separate process."""

from contextlib import contextmanager
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
import numpy as np
import pytest
from rclpy.clock import ClockType
from rclpy.parameter import Parameter
from rclpy.time import Time
from ros_helpers import until
from tf2_echoes import Tf2Echo
from tf2_msgs.msg import TFMessage
from tf_tree_py.beyond.corrections.anchor import Anchor
from tf_tree_py.core import Pose, se3
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.relocalisation_anchor import NAME, RelocalisationAnchor
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.ros.messages.convert import as_sample
from tf_tree_py.ros.messages.pose_covariances import pose_with_covariance_stamped
from tf_tree_py.ros.topics.qos import dynamic_qos

MS = 1_000_000
COVARIANCE = np.diag([1e-4] * 3 + [1e-5] * 3)
MAP_T_ODOM = Pose.from_xyz_rpy(x=2.0, y=-1.0, yaw=0.4)
THERE = Pose(x=10.0)
NEXT = Pose.from_xyz_rpy(x=0.03, yaw=0.004) @ MAP_T_ODOM


class Robot:
    """A robot at rest in odom, a relocaliser, and the received samples of map -> odom."""

    def __init__(self, node):
        self.heard = []
        self._tf = node.create_publisher(TFMessage, 'tf', dynamic_qos())
        self._pose = node.create_publisher(PoseWithCovarianceStamped, 'pose', 10)
        node.create_subscription(TFMessage, 'tf', self._hear, dynamic_qos())
        self.statuses = []
        node.create_subscription(DiagnosticArray, '/diagnostics', lambda message:
                                 self.statuses.extend(message.status), 10)

    def _hear(self, message):
        self.heard += [sample for sample in map(as_sample, message.transforms)
                       if sample.child == 'odom']

    def wait_for_anchor(self):
        # One is this node's subscription, the other the anchor's.
        until(lambda: self._pose.get_subscription_count() and
              self._tf.get_subscription_count() == 2)

    def drive(self, stamp, odom_T_base=THERE):
        self._tf.publish(write([Sample('odom', 'base_link', stamp, odom_T_base)]))

    def see(self, stamp, map_T_odom, frame='map'):
        self._pose.publish(pose_with_covariance_stamped(
            frame, stamp, map_T_odom @ Pose(x=10.0), COVARIANCE))

    def wait_for(self, map_T_odom):
        """Wait until this pose is published, up to rounding; return all samples so far."""
        until(lambda: self.heard and max(
            se3.distance(self.heard[-1].pose, map_T_odom)) < 2e-3)
        return list(self.heard)


@pytest.fixture
def robot(robot_node):
    return Robot(robot_node)


@contextmanager
def anchored(context, robot, **parameters):
    node = RelocalisationAnchor(context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])
    with spun_in_background(node):
        robot.wait_for_anchor()
        yield node


def see_twice(robot, map_T_odom):
    """Publish two sightings at old stamps, with odometry at these stamps."""
    now = time.time_ns()
    for stamp in (now - 400 * MS, now - 300 * MS):
        robot.drive(stamp)
        robot.see(stamp, map_T_odom)


def test_two_poses_that_agree_are_published_and_the_next_is_gone_over_to(context, robot):
    with anchored(context, robot, rate_hz=100.0, wait=60.0):
        see_twice(robot, MAP_T_ODOM)
        robot.wait_for(MAP_T_ODOM)
        for _ in range(12):  # the anchor accepts it gradually
            see_twice(robot, NEXT)
        samples = robot.wait_for(NEXT)
    assert max(se3.distance(samples[0].pose, MAP_T_ODOM)) < 1e-6
    stamps = np.array([sample.stamp for sample in samples])
    assert (np.diff(stamps) > 0).all() and samples[0].parent == 'map'
    places = np.array([(Pose._make(sample.pose) @ Pose(x=10.0))[:3] for sample in samples])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(stamps) * 1e9
    assert 0.01 < speeds.max() <= 0.2 + 1e-6


def test_slip_is_made_up_for_at_30_hz_and_never_the_other_way(context, robot, monkeypatch):
    """The stamps have a rate of 30 Hz, however long the machine takes to deliver them."""
    rng, slip, max_speed = np.random.default_rng(5), 0.3, 2.0
    seen, update = [], Anchor.update
    monkeypatch.setattr(Anchor, 'update', lambda anchor, sighting: (
        seen.append(sighting.stamp), update(anchor, sighting))[1])
    begin = time.time_ns() - 60_000 * MS
    with anchored(context, robot, rate_hz=100.0, max_speed=max_speed, wait=60.0):
        for number in range(90):
            stamp = begin + number * 1000 * MS // 30
            # After a second the wheels slip: the odometry moves, and the robot does not.
            robot.drive(stamp, Pose(x=10.0 + (slip if number >= 30 else 0.0)))
            robot.see(stamp, Pose(*rng.normal(0.0, 0.01, 3).tolist()))
            until(lambda stamp=stamp: stamp in seen)
        until(lambda: robot.heard and abs(robot.heard[-1].pose[0] + slip) < 0.02)
    heard = list(robot.heard)  # more may still arrive
    stamps = np.array([sample.stamp for sample in heard])
    places = np.array([sample.pose[:3] for sample in heard])
    assert (np.diff(stamps) > 0).all()
    assert places[:, 0].max() < 0.05 and places[:, 0].min() > -slip - 0.05
    gone = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert (gone <= max_speed * np.diff(stamps) * 1e-9 + 1e-6).all()


def test_what_is_of_no_use_is_told_and_no_more(context, robot, log):
    with anchored(context, robot):
        robot.see(time.time_ns(), MAP_T_ODOM, frame='world')
        until(lambda: "its edge is 'world' -> 'base_link', not 'map' -> 'base_link'" in log())
        # A pose with all fields at zero, including the quaternion, is not valid.
        for stamp in (time.time_ns() - 500 * MS, time.time_ns() - 400 * MS):
            robot.drive(stamp)
            message = pose_with_covariance_stamped('map', stamp, Pose(), COVARIANCE)
            message.pose.pose.orientation.w = 0.0
            robot._pose.publish(message)
        see_twice(robot, MAP_T_ODOM)
        robot.wait_for(MAP_T_ODOM)
    assert max(se3.distance(robot.heard[0].pose, MAP_T_ODOM)) < 1e-6


FAR = Pose.from_xyz_rpy(x=3.0, yaw=1.2) @ MAP_T_ODOM


def see_four_times(robot, map_T_odom):
    for _ in range(2):
        see_twice(robot, map_T_odom)


def test_long_way_to_the_estimate_is_logged_and_on_diagnostics(context, robot, log):
    """As after a kidnapping: the blend would last for half a minute."""
    with anchored(context, robot, rate_hz=100.0, wait=60.0):
        until(lambda: robot.statuses)
        assert robot.statuses[0].level == DiagnosticStatus.STALE
        see_twice(robot, MAP_T_ODOM)
        robot.wait_for(MAP_T_ODOM)
        see_four_times(robot, FAR)
        until(lambda: robot.statuses[-1].level == DiagnosticStatus.WARN)
        status = robot.statuses[-1]
        values = {each.key: each.value for each in status.values}
        assert status.name == f'{NAME}: map -> odom'
        assert values['Relocalisations'] == '1' and values['Jumps'] == '0'
        assert 0.0 < float(values['Angle to go (rad)']) <= 1.2
        assert 5.0 < float(values['Time to go (s)']) < 60.0
        until(lambda: 'agree on another estimate: map -> odom is' in log())
        assert 'jumps' not in log()


def test_beyond_the_limit_of_a_jump_it_jumps_and_logs_how_far(context, robot, log):
    with anchored(context, robot, rate_hz=100.0, wait=60.0, jump_turn_above=1.0):
        see_twice(robot, MAP_T_ODOM)
        robot.wait_for(MAP_T_ODOM)
        see_four_times(robot, FAR)
        samples = robot.wait_for(FAR)
        until(lambda: any(each.key == 'Jumps' and each.value == '1'
                          for status in robot.statuses for each in status.values))
    until(lambda: 'map -> odom jumps by' in log())
    steps = [se3.distance(before.pose, after.pose)[1]
             for before, after in zip(samples, samples[1:], strict=False)]
    assert max(steps) > 1.0 and sum(step > 1e-3 for step in steps) == 1


def test_clock_that_trembles_is_no_new_run_and_one_that_starts_again_is(context, log):
    node = RelocalisationAnchor(context=context, parameter_overrides=[
        Parameter('use_sim_time', value=True)])
    for milliseconds in (10_000, 9980, 10_010, 9500):
        node.get_clock().set_ros_time_override(Time(
            nanoseconds=milliseconds * MS, clock_type=ClockType.ROS_TIME))
        node.publish()
    assert 'starting again' not in log()
    node.get_clock().set_ros_time_override(Time(clock_type=ClockType.ROS_TIME))
    node.publish()
    assert 'The clock went back by 10.010 s: starting again' in log()
    node.destroy_node()


def test_parameter_that_names_no_frame_is_refused(context):
    with pytest.raises(BadInput, match='odom_frame'):
        RelocalisationAnchor(context=context, parameter_overrides=[
            Parameter('odom_frame', value='/')])


def test_program_runs_and_ends_with_ctrl_c(start, robot):
    program = start(NAME, '--ros-args', '-p', 'frame:=base_link')
    robot.wait_for_anchor()
    see_twice(robot, MAP_T_ODOM)
    robot.wait_for(MAP_T_ODOM)
    program.interrupt()
    assert program.end() == 0


# --- nodes without this package

SHIFTED = Pose(x=0.06) @ MAP_T_ODOM


@pytest.fixture
def tf2_echo():
    """Return tf2's own C++ program, listening to map -> odom."""
    program = Tf2Echo('map', 'odom')
    yield program
    program.kill()


def test_tf2_echo_sees_the_correction_and_nothing_faster_than_stated(context, robot, tf2_echo):
    with anchored(context, robot, rate_hz=100.0, wait=60.0):
        see_twice(robot, MAP_T_ODOM)
        tf2_echo.wait_for('Translation: [2.000, -1.000', 5)
        for _ in range(12):
            see_twice(robot, SHIFTED)
        tf2_echo.wait_for('Translation: [2.06', 5)
    _, places = tf2_echo.samples
    assert len({tuple(place) for place in places}) > 5  # it is seen before the end of the blend
    tf2_echo.assert_no_faster(0.2)
