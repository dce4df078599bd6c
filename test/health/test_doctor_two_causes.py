# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Where a healthy robot leaves the same data as a fault, the doctor names both or neither."""

from doctor_findings import only, worth_reporting
import numpy as np
import pytest
from robot_model import Edge, keep, planar, Robot
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.doctor import Doctor


def note(robot, code, doctor=None):
    """Return the only finding, a note with this code."""
    found = only(robot.findings(doctor))
    assert (found.code, found.severity) == (code, Severity.NOTE)
    return found


def seen(t):
    """Return the poses of something that a camera on the robot sees."""
    return planar(2.0 + 0.3 * np.sin(t), 0.1 * np.cos(t), 0.2 * np.sin(t))


def turning(rate):
    def poses(t):
        return planar(0.2 + 0.0 * t, 0.0 * t, rate * t)
    return poses


# --- jumps

@pytest.mark.parametrize('meters', [0.5, 1.5, 5.0])
def test_correction_at_10_hz_is_a_note_of_any_size(meters):
    robot = Robot()
    edge = robot.edges['odom']
    edge.poses[edge.stamps > 8.0, 0] += meters
    found = only(robot.findings())
    assert found.code in ('pose_jump', 'interpolated_jump')
    assert found.severity is Severity.NOTE and 'localiser' in found.cause


@pytest.mark.parametrize('meters', [0.8, 2.5])
def test_odometry_of_a_robot_that_stands_is_no_localiser(meters):
    """Below it there are only wheels, and it was as slow as they are."""
    robot = Robot(localiser_hz=8.0)
    robot.edges = {'base': robot.edges['odom']}
    base = robot.edges['base']
    base.parent, base.child = 'odom', 'base'
    base.poses[base.stamps > 8.0, 0] += meters
    robot.add('base', 'wheel', 8.0, turning(2.0), 'wheels')
    found = only(worth_reporting(robot))
    assert found.code in ('pose_jump', 'interpolated_jump')
    assert 'localiser, which' not in found.cause


def test_correction_that_takes_a_second_asks_for_a_higher_rate():
    robot = Robot(localiser_hz=1.0, seconds=40.0)
    edge = robot.edges['odom']
    edge.poses[edge.stamps > 18.0, 0] += 1.5
    found = only(worth_reporting(robot))
    assert found.code == 'interpolated_jump' and 'more often' in found.fix


@pytest.mark.parametrize(('rate_hz', 'rate'), [(100, 728.0), (50, 527.0), (50, 99.0)])
def test_rotor_may_turn_faster_than_its_samples_show(rate_hz, rate):
    robot = Robot()
    robot.add('base', 'rotor', rate_hz, turning(rate), 'motors')
    found = note(robot, 'too_fast')
    assert 'rotor' in found.cause and 'degrees' in found.cause


def test_joint_in_degrees_is_still_a_warning():
    """It slows down and turns back, unlike a rotor."""
    robot = Robot(arm_hz=200.0)
    robot.add('base', 'joint', 200.0, lambda t: planar(
        0.0 * t, 0.0 * t, np.degrees(2.4 * np.sin(t))), 'arm')
    found = only(worth_reporting(robot))
    assert found.code == 'too_fast'


# --- what ends

def test_nodes_that_end_one_after_another_were_stopped():
    robot = Robot(seconds=30.0)
    for child, end in (('odom', 28.1), ('base', 28.9)):
        keep(robot.edges[child], robot.edges[child].stamps < end)
    assert worth_reporting(robot, Doctor(recorded=True)) == []
    assert {one.code for one in worth_reporting(robot)} == {'stale'}


def test_single_node_that_ends_before_a_recording_is_a_warning():
    robot = Robot(seconds=30.0)
    keep(robot.edges['odom'], robot.edges['odom'].stamps < 28.1)
    found = only(worth_reporting(robot, Doctor(recorded=True)))
    assert (found.code, found.severity) == ('stale', Severity.WARNING)


@pytest.mark.parametrize('child', ['tag', 'base'])
def test_last_tag_of_a_camera_may_have_left_but_wheels_have_not(child):
    robot = Robot(seconds=30.0)
    robot.add('tool', 'tag', 15, seen, 'detector')
    keep(robot.edges[child], robot.edges[child].stamps < 12.0)
    found = only(worth_reporting(robot))
    assert found.code == 'stale'
    assert found.severity is (Severity.WARNING if child == 'tag' else Severity.ERROR)
    assert ('view' in found.cause) is (child == 'tag')


def test_objects_that_leave_one_after_another_are_no_errors():
    robot = Robot(seconds=40.0)
    for number in range(5):
        robot.add('map', f'box_{number}', 10, lambda t: planar(0.3 * t, 0.0 * t, 0.0 * t), 'belt')
        stamps = robot.edges[f'box_{number}'].stamps
        keep(robot.edges[f'box_{number}'], (stamps > 5 * number) & (stamps < 5 * number + 8))
    found = worth_reporting(robot)
    assert found and all((one.code, one.severity) == ('stale', Severity.WARNING) for one in found)


def test_edge_that_was_silent_for_as_long_before_is_no_error():
    robot = Robot(seconds=44.0)
    stamps = robot.edges['odom'].stamps
    keep(robot.edges['odom'], (stamps < 10.0) | (stamps > 17.0) & (stamps < 37.0))
    assert {one.code: one.severity for one in worth_reporting(robot)} == {
        'gap': Severity.WARNING, 'stale': Severity.WARNING}


def test_edge_that_came_once_has_one_finding():
    robot = Robot(seconds=40.0)
    robot.edges['goal'] = Edge('map', 'goal', np.array([5.0]), np.array([5.01]), seen(np.ones(1)),
                               'planner')
    found = only(worth_reporting(robot))
    assert found.code == 'slow_for_window' and 'came once, ' in found.summary


def test_tag_that_was_seen_once_by_a_detector_that_died_is_reported():
    robot = Robot(seconds=40.0, authority='/robot')
    for child in ('tag_0', 'tag_1'):
        robot.add('tool', child, 15, seen, 'detector')
    keep(robot.edges['tag_0'], robot.edges['tag_0'].stamps < 6.0)
    robot.edges['tag_1'] = Edge('tool', 'tag_1', np.array([5.99]), np.array([6.0]),
                                seen(np.ones(1)), 'detector')
    assert {one.frames[1] for one in worth_reporting(robot)} == {'tag_0', 'tag_1'}


# --- rates and delays

@pytest.mark.parametrize(('first_hz', 'then_hz'), [(200, 20), (10, 50), (100, 25)])
def test_rate_that_changes_is_not_irregular(first_hz, then_hz):
    robot = Robot(seconds=40.0)
    robot.add('base', 'imu', first_hz, seen, 'imu')
    slow = robot.edges['imu']
    keep(slow, slow.stamps < 15.0)
    robot.add('base', 'imu', then_hz, seen, 'imu')
    later = robot.edges['imu']
    keep(later, later.stamps >= 15.0)
    for name in ('stamps', 'received', 'poses'):
        setattr(later, name, np.concatenate([getattr(slow, name), getattr(later, name)]))
    assert 'changes its rate' in note(robot, 'irregular_rate').summary


@pytest.mark.parametrize('delay', [0.12, 0.18, 0.25])
def test_vision_may_take_a_constant_time(delay):
    robot = Robot()
    robot.add('tool', 'tag', 15, seen, 'detector')
    robot.edges['tag'].received += delay
    found = note(robot, 'clock_offset')
    assert found.cause.index('compute') < found.cause.index('clock')


def test_clock_of_a_node_that_also_sends_in_time_is_right():
    robot = Robot(authority='/robot')
    robot.edges['base'].received += 0.3
    found = only(worth_reporting(robot))
    assert found.code == 'clock_offset'
    assert 'Its clock is right: it sends ' in found.cause
    assert 'chrony' not in found.cause + found.fix


def test_clock_of_unknown_senders_may_be_wrong():
    robot = Robot()
    robot.edges['base'].received += 0.3
    found = only(worth_reporting(robot))
    assert 'clock' in found.cause and 'their node' in found.cause and 'chrony' in found.fix


@pytest.mark.parametrize('step', [-2.0, 2.0, 0.3])
def test_recorder_with_one_moving_edge_whose_clock_is_set(step):
    robot = Robot(seconds=40.0)
    for child in ('odom', 'arm', 'tool'):
        del robot.edges[child]
    edge = robot.edges['base']
    edge.received = edge.received + step * (edge.received > 20.0)
    found = worth_reporting(robot)
    assert [one.code for one in found] == ['recorder_clock']
    assert ('another network' in found[0].cause) is (step > 0)


def test_drift_of_one_edge_is_not_that_of_three_that_a_link_held_back():
    """In stamps, and not in arrivals, the three step: they lost some messages, then came late."""
    robot = Robot(simulated=True, seconds=60.0, pace=0.97, delay=0.05)
    for child in ('odom', 'arm', 'tool'):
        edge = robot.edges[child]
        keep(edge, (edge.stamps < 30.0) | (edge.stamps > 31.3))
        held = (edge.stamps > 29.0) & (edge.stamps < 30.0)
        edge.received = np.where(held, np.maximum(edge.received, 31.25 / robot.pace + 1e-4
                                                  * np.cumsum(held)), edge.received)
    robot.edges['base'].stamps *= 0.98
    drifts = [one for one in worth_reporting(robot) if one.code.startswith('clock')]
    assert [(one.code, one.edges) for one in drifts] == [('clock_drift', (('odom', 'base'),))]


def test_of_two_edges_the_one_by_the_clock_of_this_computer_is_right():
    robot = Robot()
    del robot.edges['arm'], robot.edges['tool']
    robot.edges['base'].stamps -= 1e9
    found = only(one for one in robot.findings() if one.code == 'clock_mixture')
    assert found.edges == (('odom', 'base'),)
    assert found.summary.endswith('behind map -> odom')
