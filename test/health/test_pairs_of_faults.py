# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A second fault hides none of the first one, for every pair of codes: on one edge no error."""

from functools import cache

from edge_faults import ERRORS, WARNINGS
from hypothesis import settings
import pytest
from robot_model import Robot
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Severity

# They replace values or omit samples, and with these the fault that was there before.
ONLY_BEFORE = {'static_republished', 'moved_once', 'interpolated_jump', 'gap', 'irregular_rate',
               'skew'}


@cache  # because the second error of one pair is the first of another
def errors(*faults):
    """Return the codes of a robot's errors if one edge of it has these faults."""
    # The other edges are slow, because they are not looked at.
    robot = Robot(seconds=60.0, localiser_hz=1.0, wheels_hz=1.0, jitter=0.05)
    del robot.edges['tool']
    for fault in faults:
        fault(robot, robot.edges['arm'])
    return {finding.code for finding in robot.findings() if finding.severity is Severity.ERROR}


@pytest.mark.parametrize('first', ERRORS)
def test_second_fault_hides_no_error(first):
    assert errors(ERRORS[first]) == {first}
    hidden = [(second, order) for second, fault in [*WARNINGS.items(), *ERRORS.items()]
              for order, faults in (('before', (fault, ERRORS[first])),
                                    ('after', (ERRORS[first], fault)))
              if not (order == 'after' and second in ONLY_BEFORE)
              and fault is not ERRORS[first] and first not in errors(*faults)]
    assert not hidden, (
        f'{first} is not found if the same edge has one of these faults, put in before or after: '
        f'{hidden}. A fault that replaces values or omits samples belongs in ONLY_BEFORE')


# What a fault is found as, if not by its own name, and what a robot that drives hides.
FOUND_AS = {'future_stamps': {'post_dated', 'future_stamps'}, 'jump_back': {'clock_step'},
            'post_dated': {'post_dated', 'future_stamps'}}
ELSEWHERE = {'unreadable', 'interpolated_jump', 'skew', 'moved_once'}


def seconds_of(first):
    """Return faults for the second edge: all in an exploration, others for each first one."""
    faults = [name for name in {**ERRORS, **WARNINGS} if name not in ELSEWHERE]
    begin, count = 5 * faults.index(first), 5 if settings().max_examples <= 20 else len(faults)
    return [faults[(begin + step) % len(faults)] for step in range(count)]


@pytest.mark.parametrize('first', [name for name in {**ERRORS, **WARNINGS}
                                   if name not in ELSEWHERE])
def test_faults_of_two_edges_are_both_found(first):
    for second in seconds_of(first):
        robot = Robot(seconds=30.0, wheels_hz=30.0, arm_hz=20.0, jitter=0.05)
        del robot.edges['tool']
        for name, child in ((first, 'base'), (second, 'arm')):
            {**ERRORS, **WARNINGS}[name](robot, robot.edges[child])
        found = robot.findings()
        for name, child in ((first, 'base'), (second, 'arm')):
            names = FOUND_AS.get(name, {name})
            assert any(one.code in names and child in one.frames for one in found), (
                name, second, [(one.code, one.frames) for one in found])


def test_no_code_explains_one_that_may_be_an_error():
    for code in CODES.values():
        assert not {*code.explains} & {name for name in CODES
                                       if CODES[name].severity is Severity.ERROR}, code.name


def test_no_two_codes_explain_each_other():
    assert [(one.name, other) for one in CODES.values() for other in one.explains
            if one.name in CODES[other].explains] == []
