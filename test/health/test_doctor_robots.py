# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Healthy robots of any clock, rate and jitter give no finding; a single fault is found."""

from effort import examples
from healthy_robots import HEALTHY_ROBOTS
from hypothesis import example, given, strategies as st
import pytest
from robot_model import FAULTS, Robot
from tf_tree_py.health.checks.finding import Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds

CODES = {'outliers': 'outlier'}


def rates(least, most):
    return st.floats(least, most)


PACES = st.one_of(st.none(), st.floats(0.05, 3.0))
HEALTHY = st.fixed_dictionaries({
    'seed': st.integers(0, 2**32), 'seconds': st.floats(3.0, 30.0),
    'localiser_hz': rates(1.0, 50.0), 'wheels_hz': rates(5.0, 200.0), 'arm_hz': rates(5.0, 100.0),
    'jitter': st.floats(0.0, 0.9), 'delay': st.floats(0.001, 0.05),
    'tolerance': st.sampled_from([0.0, 0.2, 1.0]), 'speed': st.sampled_from([0.0, 0.5, 2.0, 10.0]),
})
# A fault must exceed the robot's own irregularities.
STEADY = st.fixed_dictionaries({
    'seed': st.integers(0, 2**32), 'seconds': st.floats(10.0, 25.0),
    'localiser_hz': rates(5.0, 50.0), 'wheels_hz': rates(20.0, 200.0), 'arm_hz': rates(10.0, 80.0),
    'jitter': st.floats(0.0, 0.4), 'delay': st.floats(0.001, 0.01),
    'tolerance': st.sampled_from([0.0, 0.2, 1.0]), 'speed': st.sampled_from([0.5, 2.0]),
})
# Where the clocks differ, the offset of one of them cannot be determined.
OF_CLOCKS = ('clock_offset', 'future_stamps')


def robot_of(options, pace):
    return Robot(**options, simulated=pace is not None, pace=1.0 if pace is None else pace)


def worth_reporting(findings):
    return {finding.code: finding.summary for finding in findings
            if finding.severity is not Severity.NOTE}


def healthy(**options):
    """Return options of the slowest healthy robot, with some that differ."""
    return {'seed': 0, 'seconds': 3.0, 'localiser_hz': 1.0, 'wheels_hz': 5.0, 'arm_hz': 5.0,
            'jitter': 0.0, 'delay': 0.005, 'tolerance': 0.0, 'speed': 0.5, **options}


# In a short recording of a slow simulation, no edge alone shows the pace of the clock.
@example(healthy(delay=0.03125), 0.125)
# The localiser's interval, of 1 s, is also how old it may be.
@example(healthy(seed=34, wheels_hz=200.0, jitter=0.9), 0.39)
@example(healthy(seed=240, seconds=20.796, wheels_hz=17.7, arm_hz=86.1, jitter=0.831), 0.096)
# Of a few irregular intervals, the middle one is short.
@example(healthy(seed=63, seconds=5.679, arm_hz=100.0, jitter=0.9, delay=0.001), 3.0)
@example(healthy(seed=275, seconds=5.155, wheels_hz=200.0, arm_hz=100.0, jitter=0.9), 0.05)
# The median of a few jittering intervals of a second is much longer than a second.
@example(healthy(seed=10, seconds=5.0, wheels_hz=20.0, arm_hz=20.0, jitter=0.9, delay=0.05), None)
# A few samples of a very slow simulation.
@example(healthy(seconds=0.2, localiser_hz=10.0, wheels_hz=20.0, arm_hz=20.0, jitter=0.1), 0.05)
@examples(1.0)
@given(options=HEALTHY, pace=PACES)
def test_healthy_robot_gives_no_finding(options, pace):
    assert worth_reporting(robot_of(options, pace).findings()) == {}


@examples(5.0)
@given(robot=HEALTHY_ROBOTS)
def test_healthy_robot_with_every_ugliness_gives_no_finding(robot):
    assert worth_reporting(robot.findings()) == {}


@pytest.mark.parametrize('fault', FAULTS)
@examples(0.3)
@given(options=STEADY, pace=PACES, size=st.floats(0.0, 1.0))
def test_fault_is_found_and_nothing_else(fault, options, pace, size):
    robot = robot_of(options, None if fault in OF_CLOCKS else pace)
    FAULTS[fault](robot, size)
    found = worth_reporting(robot.findings())
    assert list(found) == [CODES.get(fault, fault)], found


@pytest.mark.parametrize('tolerance', [0.2, 1.0])
@pytest.mark.parametrize('pace', [None, 0.05, 0.5, 3.0])
def test_localiser_that_post_dates_is_named_as_that(pace, tolerance):
    found = robot_of({'tolerance': tolerance}, pace).findings()
    assert [(one.code, one.frames) for one in found] == [('post_dated', ('map', 'odom'))]
    assert 0.8 * tolerance < found[0].evidence['usually_s'] < 1.05 * tolerance
    assert 'clock' not in found[0].cause


def test_limits_that_are_given_hold_for_the_whole_edge():
    robot = Robot(speed=3.0)
    assert worth_reporting(robot.findings()) == {}
    slow = Doctor(Thresholds(max_speed=1.0, max_usual_speed=1.0))
    assert list(worth_reporting(robot.findings(slow))) == ['too_fast']


def test_two_publishers_that_take_turns_exactly_are_found():
    """At 125 Hz each, 4 ms and 0.2 m apart: all stamps together are regular."""
    robot = Robot(wheels_hz=125.0, jitter=0.0, delay=0.0001)
    FAULTS['two_publishers'](robot, 0.0)
    assert list(worth_reporting(robot.findings())) == ['two_publishers']


def test_step_of_the_recorders_clock_is_no_second_publisher():
    """The recordings before and after the step overlap."""
    robot = Robot(seconds=20.0, speed=2.0)
    for edge in robot.edges.values():
        after = edge.stamps > 10.0
        edge.stamps = edge.stamps - 0.7 * after
        edge.received = edge.received - 0.7 * after
    assert 'two_publishers' not in worth_reporting(robot.findings())


def test_static_edge_that_is_sent_as_moving_with_one_stamp_is_one_finding():
    robot = Robot()
    edge = robot.edges['arm']
    edge.stamps, edge.poses = 0.0 * edge.stamps + 1.0, 0.0 * edge.poses + edge.poses[0]
    assert list(worth_reporting(robot.findings())) == ['frozen_stamp']
