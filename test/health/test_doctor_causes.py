# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The doctor names the real cause where another one is more plausible at first sight."""

from doctor_findings import only, worth_reporting
from edge_faults import merge
from healthy_robots import Habits, UglyRobot
import numpy as np
import pytest
from robot_model import Edge, keep, planar, Robot
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.doctor import Doctor

LATE = [(0.133, 0.3, late) for late in (0.05, 0.1, 0.13)] + [
    (0.1, 0.5, late) for late in (0.03, 0.06, 0.09)] + [(0.05, 1.0, 0.04)]


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize(('every', 'speed', 'late'), LATE)
def test_driver_that_stamps_late_is_one_publisher(every, speed, late, seed):
    """It stamps a sample when it has read the serial port."""
    robot = Robot(seed=seed, seconds=60.0)
    times = np.arange(0.0, robot.seconds, every)
    wheels = robot.edges['base']
    wheels.stamps = times + late * robot.rng.random(len(times))
    wheels.received = wheels.stamps + 0.004
    wheels.poses = planar(speed * times, 0.0 * times, 0.2 * np.sin(0.3 * times))
    assert worth_reporting(robot) == []


@pytest.mark.parametrize('late', [0.01, 0.02, 0.04])
def test_driver_that_stamps_every_other_sample_late_is_one_publisher(late):
    """It reads two samples at a time."""
    robot = Robot(seconds=60.0)
    times = np.arange(0.0, robot.seconds, 0.05)
    wheels = robot.edges['base']
    wheels.stamps = times + late * (np.arange(len(times)) % 2 == 0)
    wheels.received = wheels.stamps + 0.004
    wheels.poses = planar(np.sin(times), 0.5 * times, 0.4 * np.sin(0.7 * times))
    assert {one.code for one in worth_reporting(robot)} <= {'irregular_rate'}


# --- two sources

def wheel(rate):
    """Return the poses of a wheel that turns, over time."""
    def poses(times):
        turned = np.zeros((len(times), 7))
        turned[:, 1], turned[:, 4], turned[:, 6] = (
            0.2, np.sin(0.5 * rate * times), np.cos(0.5 * rate * times))
        return turned
    return poses


def zeros(count):
    return np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (count, 1))


def replaced(robot, edge):
    edge.poses[1::2] = zeros(len(edge.poses[1::2]))


def zeros_between(robot, edge):
    merge(edge, edge.stamps + 0.01, zeros(len(edge.stamps)))


def zeros_at_20_hz(robot, edge):
    times = np.arange(0.0, robot.seconds, 0.05) + 0.0013
    merge(edge, times, zeros(len(times)))


def zeros_at_the_same_stamps(robot, edge):
    merge(edge, edge.stamps, zeros(len(edge.stamps)), delay=0.006)


def an_old_pose_between(robot, edge):
    merge(edge, edge.stamps + 0.006, np.tile(edge.poses[40], (len(edge.poses), 1)))


@pytest.mark.parametrize('source', [replaced, zeros_between, zeros_at_20_hz,
                                    zeros_at_the_same_stamps, an_old_pose_between])
@pytest.mark.parametrize(('child', 'poses'), [
    ('base', None), ('arm', None), ('wheel', wheel(5.0)), ('wheel', wheel(20.0))],
    ids=['drives', 'swings', 'turns', 'turns fast'])
def test_two_sources_that_alternate_are_found(child, poses, source):
    robot = Robot(seconds=30.0, jitter=0.05)
    if poses:
        robot.add('base', 'wheel', 50.0, poses, 'wheel')
    source(robot, robot.edges[child])
    assert [(one.code, one.frames[1]) for one in worth_reporting(robot)] == [
        ('two_publishers', child)]


@pytest.mark.parametrize('late', [0.0, 0.5, 1.0])
@pytest.mark.parametrize('part', [0.42, 0.46, 0.5])
def test_vibration_is_one_publisher(late, part):
    robot = Robot(seconds=30.0)
    times = np.arange(0.0, robot.seconds, 0.02)
    wheels = robot.edges['base']
    wheels.stamps = times + 0.02 * late * robot.rng.random(len(times))
    wheels.received = wheels.stamps + 0.004
    wheels.poses = planar(0.3 * times, 0.02 * np.sin(2.0 * np.pi * part * 50.0 * times + 0.1),
                          0.0 * times)
    assert worth_reporting(robot) == []


@pytest.mark.parametrize('rate_hz', [10.0, 20.0, 50.0])
@pytest.mark.parametrize('part', [0.45, 0.5, 0.55])
def test_frame_that_turns_by_half_a_turn_a_sample_is_one_publisher(part, rate_hz):
    """A lidar on a mount that spins, a few centimetres beside the axis."""
    robot = Robot(seconds=30.0)
    robot.add('base', 'lidar_head', rate_hz, lambda times: planar(
        0.03 * np.cos(angle := 2.0 * np.pi * part * rate_hz * times), 0.03 * np.sin(angle),
        angle), 'lidar')
    assert 'two_publishers' not in {one.code for one in worth_reporting(robot)}


def test_sway_at_half_the_rate_is_one_publisher():
    """A robot that trots at 5 Hz, seen at 10 Hz."""
    robot = Robot(seconds=30.0)
    robot.add('base', 'torso', 10.0, lambda times: planar(
        0.0 * times, 0.04 * (-1.0) ** np.rint(10.0 * times), 0.0 * times), 'legs')
    assert worth_reporting(robot) == []


def test_second_publisher_late_in_a_run_is_found():
    robot = Robot(seconds=60.0)
    late = robot.edges['arm'].stamps > 54.0
    merge(robot.edges['arm'], robot.edges['arm'].stamps[late] + 0.004,
          robot.edges['arm'].poses[late] + np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert [one.code for one in worth_reporting(robot)] == ['two_publishers']


def test_two_robots_on_one_topic_are_named_as_that():
    robot, other = Robot(seconds=30.0), Robot(seed=5, seconds=30.0, speed=0.5)
    for child in ('odom', 'base', 'arm', 'tool'):
        second = other.edges[child]
        poses = second.poses + np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        merge(robot.edges[child], second.stamps + 0.003, poses)
    found = only(worth_reporting(robot))
    assert (found.code, found.evidence) == ('two_publishers', {'edges': 4})
    assert 'two robots' in found.summary


# --- steps

@pytest.mark.parametrize('pause', [0.0, 1.2])
@pytest.mark.parametrize('step', [0.03, 0.1, 0.5])
def test_resting_edge_that_steps_is_found(step, pause):
    """A calibration on /tf has another value after a restart."""
    robot = Robot(seconds=30.0)
    robot.add('base', 'camera', 20.0, lambda times: planar(
        0.2 + step * (times > 15.0), 0.0 * times, step * (times > 15.0)), 'calibration')
    camera = robot.edges['camera']
    keep(camera, (camera.stamps < 15.0) | (camera.stamps > 15.0 + pause))
    found = {one.code: one for one in worth_reporting(robot)}
    assert set(found) == {'moved_once', 'gap'} if pause else {'moved_once'}
    assert found['moved_once'].evidence['gone_m'] == pytest.approx(step)
    assert found['moved_once'].evidence['after_stamp_s'] == pytest.approx(
        1_700_000_015.0, abs=0.1)


def test_joint_that_is_set_in_one_step_is_a_note():
    robot = Robot(seconds=30.0)
    robot.add('base', 'flap', 20.0, lambda times: planar(
        0.2 + 0.0 * times, 0.0 * times, 0.5 * (times > 15.0)), 'flap')
    found = only(robot.findings())
    assert (found.code, found.severity) == ('moved_once', Severity.NOTE)


@pytest.mark.parametrize(('step', 'rate_hz', 'code'), [
    (5.0, 20.0, 'pose_jump'), (5.0, 10.0, 'pose_jump'), (1.0, 10.0, 'interpolated_jump'),
    (0.5, 5.0, 'interpolated_jump')])
def test_jump_of_a_frame_that_turns_fast_is_found(step, rate_hz, code):
    robot = Robot(seconds=30.0)
    robot.add('base', 'drum', rate_hz, lambda times: planar(
        0.2 + step * (times > 15.0), 0.0 * times, 20.0 * times), 'drum')
    found = only(worth_reporting(robot))
    assert (found.code, found.frames) == (code, ('base', 'drum'))
    assert found.evidence['gone_m'] == pytest.approx(step)


def test_turn_is_no_jump_if_others_are_faster():
    """A robot that turns now and then, between samples, may turn by 19 degrees once."""
    robot = Robot(seconds=120.0)
    turns = np.tile([0.0] * 45 + [0.5] * 5, 12)
    turns[20] = 0.34
    robot.add('base', 'turret', 4.8, lambda times: planar(
        0.3 + 0.01 * times, 0.0 * times, np.cumsum(turns[:len(times)])), 'turret')
    assert worth_reporting(robot) == []


# --- clocks

@pytest.mark.parametrize('behind', [('odom', 'base'), ('base', 'arm'), ('odom', 'arm'),
                                    ('odom', 'base', 'arm')])
def test_groups_of_a_simulation_are_both_listed(behind):
    """Its stamps do not show whether one group is 300 ms behind or the other is ahead."""
    robot = Robot(simulated=True, pace=0.8)
    for child in behind:
        robot.edges[child].stamps = robot.edges[child].stamps - 0.3
    found = only(robot.findings())
    ahead = {'odom', 'base', 'arm', 'tool'} - {*behind}
    assert (found.code, found.severity) == ('clock_offset', Severity.WARNING)
    assert {child for _, child in found.edges[:found.evidence['ahead']]} == ahead
    assert {child for _, child in found.edges[found.evidence['ahead']:]} == {*behind}
    assert found.evidence['apart_s'] == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize('step', [-3600.0, -10.0, -2.0, -0.5, 0.5, 2.0, 10.0, 3600.0])
def test_step_of_the_recorders_clock_is_named_as_that(step):
    robot = Robot(seconds=30.0, tolerance=0.2)
    for edge in robot.edges.values():
        edge.received = edge.received + step * (edge.received > 10.0)
    found = only(worth_reporting(robot, Doctor(recorded=True)))
    assert (found.code, len(found.edges)) == ('recorder_clock', 4)
    assert found.evidence['step_s'] == pytest.approx(step, abs=0.02)
    assert found.evidence['received_s'] == pytest.approx(1_700_000_010.0, abs=0.5)


def test_step_of_all_senders_is_not_the_recorders():
    robot = Robot(seconds=30.0)
    for edge in robot.edges.values():
        edge.stamps = edge.stamps + 2.0 * (edge.stamps > 10.0)
    assert [one.code for one in worth_reporting(robot)] == ['clock_step']


def test_fault_beside_a_step_of_the_recorders_clock_is_found():
    robot = Robot(seconds=30.0)
    merge(robot.edges['arm'], robot.edges['arm'].stamps + 0.004,
          robot.edges['arm'].poses + np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for edge in robot.edges.values():
        edge.received = edge.received - 2.0 * (edge.received > 10.0)
    assert {one.code for one in worth_reporting(robot, Doctor(recorded=True))} == {
        'two_publishers', 'recorder_clock'}


@pytest.mark.parametrize('step', [-2.0, 2.0])
def test_gap_beside_a_step_of_the_recorders_clock_is_found(step):
    robot = Robot(seconds=60.0)
    keep(robot.edges['arm'], (robot.edges['arm'].stamps < 10.0) | (
        robot.edges['arm'].stamps > 15.0))
    for edge in robot.edges.values():
        edge.received = edge.received + step * (edge.received > 30.0)
    found = worth_reporting(robot, Doctor(recorded=True))
    assert {one.code for one in found} == {'gap', 'recorder_clock'}
    assert [one.frames for one in found if one.code == 'gap'] == [('base', 'arm')]


def test_computer_that_starts_in_1970_has_no_slow_edges():
    robot = Robot(seconds=60.0)
    for edge in robot.edges.values():
        early = edge.received < 10.0
        edge.stamps, edge.received = (times - 1.699e9 * early
                                      for times in (edge.stamps, edge.received))
    found = only(robot.findings(Doctor(recorded=True)))
    assert (found.code, found.evidence['edges']) == ('gap', 4)
    assert '1970' in found.cause


@pytest.mark.parametrize('back', [40.0, 3600.0, 86_400.0])
def test_computer_whose_clock_is_set_back_before_the_recording_is_no_recorder(back):
    """All senders step back by more than the time so far; their messages continue to arrive."""
    robot = Robot(seconds=30.0)
    for edge in robot.edges.values():
        edge.stamps = edge.stamps - back * (edge.stamps > 15.0)
    assert 'recorder_clock' not in {one.code for one in worth_reporting(robot)}


@pytest.mark.parametrize('step', [-2.0, 2.0])
def test_step_of_the_recorders_clock_is_found_beside_edges_that_did_not_see_it(step):
    robot = Robot(seconds=40.0)
    keep(robot.edges['arm'], robot.edges['arm'].received > 25.0)
    keep(robot.edges['odom'], robot.edges['odom'].received < 15.0)
    for edge in robot.edges.values():
        edge.received = edge.received + step * (edge.received > 20.0)
    assert 'recorder_clock' in {one.code for one in worth_reporting(robot, Doctor(recorded=True))}


def test_longer_way_may_look_like_a_step_of_the_recorders_clock():
    robot = Robot(seconds=40.0)
    for edge in robot.edges.values():
        edge.received = edge.received + 0.2 * (edge.received > 20.0)
    found = only(worth_reporting(robot))
    assert found.code == 'recorder_clock'
    assert 'another network' in found.cause


# --- localisers

@pytest.mark.parametrize('above', ['static', 'moving', 'none'])
def test_correction_is_a_note_whatever_is_above_the_map(above):
    robot = Robot(seconds=30.0, localiser_hz=20.0)
    robot.edges['odom'].poses[robot.edges['odom'].stamps > 15.0, 0] += 3.0
    if above == 'static':
        robot.edges['map'] = Edge('world', 'map', np.zeros(1), np.array([-0.2]), zeros(1), 'urdf',
                                  static=True)
    elif above == 'moving':
        robot.add('earth', 'map', 5.0, lambda times: planar(
            0.001 * np.floor(times), 0.0 * times, 0.0 * times), 'gps')
    assert worth_reporting(robot) == []


@pytest.mark.parametrize('turns', [0.0, 1.0])
def test_reset_of_an_odometry_is_no_correction_though_a_joint_is_below(turns):
    robot = Robot(seconds=30.0)
    del robot.edges['odom'], robot.edges['tool']
    robot.edges['arm'].poses[:] = robot.edges['arm'].poses[:1] if not turns else (
        robot.edges['arm'].poses)
    robot.edges['base'].poses[robot.edges['base'].stamps > 15.0, 0] += 20.0
    found = {one.code: one for one in worth_reporting(robot)}
    assert found['pose_jump'].frames == ('odom', 'base')


def test_filters_that_post_date_alike_are_notes():
    robot = Robot(seconds=30.0, tolerance=0.3)
    robot.edges['base'].stamps = robot.edges['base'].stamps + 0.3
    found = robot.findings()
    assert {(one.code, one.frames) for one in found} == {
        ('post_dated', ('map', 'odom')), ('post_dated', ('odom', 'base'))}


# --- arrivals

def test_backlog_is_one_finding():
    robot = Robot(seconds=60.0)
    for child in ('base', 'arm', 'tool'):
        edge = robot.edges[child]
        held = (edge.received > 20.0) & (edge.received < 24.0)
        edge.received = np.maximum.accumulate(np.where(held, 24.0, edge.received))
    found = only(worth_reporting(robot))
    assert (found.code, found.evidence['edges']) == ('delayed', 3)
    assert found.evidence['longest_s'] == pytest.approx(4.0, abs=0.1)
    assert found.evidence['received_s'] == pytest.approx(1_700_000_024.0, abs=0.1)


def test_whole_seconds_do_not_hide_a_gap():
    robot = Robot(seconds=60.0)
    arm = robot.edges['arm']
    keep(arm, (arm.stamps < 20.5) | (arm.stamps > 23.5))
    arm.stamps = np.floor(arm.stamps)
    assert {one.code for one in worth_reporting(robot)} == {'whole_seconds', 'gap'}


def test_stamps_out_of_order_do_not_hide_a_drift():
    robot = Robot(seconds=60.0, arm_hz=5.0)
    del robot.edges['tool']
    arm = robot.edges['arm']
    late = np.arange(len(arm.stamps)) % 10 == 5
    arm.stamps = 0.98 * (arm.stamps - 0.5 * late)
    assert {one.code for one in worth_reporting(robot)} == {'out_of_order', 'clock_drift'}


def test_gap_of_all_edges_is_a_note_only_in_a_recording():
    """A recorder may be paused."""
    robot = Robot(seconds=30.0)
    for edge in robot.edges.values():
        keep(edge, (edge.received < 10.0) | (edge.received > 14.0))
    for recorded, severity in ((True, Severity.NOTE), (False, Severity.WARNING)):
        found = only(robot.findings(Doctor(recorded=recorded)))
        assert (found.code, found.severity) == ('gap', severity)


def test_edge_that_stops_alone_is_a_warning_in_a_recording():
    robot = Robot(seconds=30.0)
    keep(robot.edges['arm'], (robot.edges['arm'].received < 10.0) | (
        robot.edges['arm'].received > 14.0))
    found = only(robot.findings(Doctor(recorded=True)))
    assert (found.code, found.severity, found.frames) == (
        'gap', Severity.WARNING, ('base', 'arm'))


# --- repeated and static transforms

def test_static_transform_that_is_sent_again_as_float32_has_not_changed():
    robot = Robot()
    lidar = robot.edges['lidar']
    lidar.poses = planar(np.array([471_000.123456789, 0.0]), np.zeros(2), np.full(2, 0.1))
    lidar.poses[1] = lidar.poses[0].astype(np.float32)
    lidar.stamps, lidar.received = np.zeros(2), np.array([-0.2, 3.0])
    assert worth_reporting(robot) == []
    lidar.poses[1, 0] += 0.2
    assert [one.code for one in worth_reporting(robot)] == ['static_changed']


def test_messages_that_arrive_twice_are_a_note():
    robot = Robot()
    arm = robot.edges['arm']
    for name in ('stamps', 'received', 'poses'):
        setattr(arm, name, np.repeat(getattr(arm, name), 2, axis=0))
    found = only(robot.findings())
    assert (found.code, found.severity) == ('duplicate_stamps', Severity.NOTE)
    assert (found.evidence['count'], found.evidence['differing']) == (1000, 0)


def test_robot_that_stands_may_send_the_same_pose():
    robot = Robot()
    robot.edges['base'].poses[:] = robot.edges['base'].poses[0]
    found = only(robot.findings())
    assert (found.code, found.severity) == ('static_republished', Severity.NOTE)


def test_wheel_does_not_make_its_robot_a_localiser():
    """The jump of a wheel odometry is no correction, though a joint moves below it."""
    robot = Robot(seconds=30.0)
    del robot.edges['odom'], robot.edges['arm'], robot.edges['tool']
    robot.add('base', 'wheel', 50.0, wheel(5.0), 'wheels')
    base = robot.edges['base']
    base.poses[base.stamps > 15.0, 0] += 20.0
    found = only(robot.findings())
    assert (found.code, found.severity, found.frames) == (
        'pose_jump', Severity.WARNING, ('odom', 'base'))


@pytest.mark.parametrize(('authority', 'senders'), [
    ('one of /a, /b', 'one of /a, /b'), ('/a', '/a'), ('', '')])
def test_sender_that_is_not_known_is_one_of_several(authority, senders):
    robot = Robot(seconds=20.0)
    keep(robot.edges['base'], robot.edges['base'].stamps < 8.0)
    robot.authority = authority
    found = only(worth_reporting(robot))
    assert (found.code, found.senders) == ('stale', senders)


@pytest.mark.parametrize(('apart', 'words'), [(0.001, 'at once'), (2.0, 'changed')])
def test_static_transform_with_two_values_is_not_said_to_have_changed(apart, words):
    """A recorder that joins receives the value of each publisher."""
    robot = Robot()
    lidar = robot.edges['lidar']
    lidar.poses = planar(np.array([0.1, 0.2]), np.zeros(2), np.zeros(2))
    lidar.stamps, lidar.received = np.zeros(2), np.array([-0.2, -0.2 + apart])
    found = only(worth_reporting(robot))
    assert found.code == 'static_changed'
    assert words in found.summary
    assert ('two nodes' in found.cause) == (words == 'at once')


@pytest.mark.parametrize('stamp', [300.0, 1_700_000_000.0 - 31_536_000.0, 1_699_999_880.0])
@pytest.mark.parametrize('place', [0, 1, 300])
def test_lone_stamp_is_named(place, stamp):
    """It is of boot time, of last year, or two minutes old."""
    robot = Robot(seconds=20.0)
    robot.edges['base'].stamps[place] = stamp - 1_700_000_000.0
    found = only(worth_reporting(robot))
    assert (found.code, found.frames, found.evidence['count']) == (
        'lone_stamp', ('odom', 'base'), 1)
    assert found.evidence['stamp_s'] == pytest.approx(stamp)
    assert found.evidence['received_s'] == pytest.approx(robot.edges['base'].received[place]
                                                         + 1_700_000_000.0)


def test_bursts_of_a_simulation_are_no_group_with_another_clock():
    """The delays are relative to those of most edges, which here are late by a burst."""
    robot = UglyRobot(simulated=True, pace=0.3, seconds=15.0, habits={
        'wheels': Habits(5.0, burst=3), 'localiser': Habits(5.0, 'correct', burst=3),
        'arm': Habits(10.0, 'swing'), 'wheel': Habits(10.0, 'spin')})
    assert worth_reporting(robot) == []
