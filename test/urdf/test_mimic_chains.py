# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Chains of mimic joints: of any length, and with any numbers."""

import sys
import warnings

from descriptions import joint, parsed
import numpy as np
import pytest
from tf_tree_py.core import InvalidArgumentException
from tf_tree_py.urdf import joints
from tf_tree_py.urdf.joint_states import JointStates


def chain(length):
    """Return joints, each of which mimics the next; the last one is independent."""
    return [joint(f'j{n}', 'prismatic', f'l{n}', f'l{n + 1}', '' if n == length - 1 else
                  f'<mimic joint="j{n + 1}" multiplier="-1" offset="1"/>')
            for n in range(length)]


def lines_run(length):
    """Return how many lines of the module run while a chain is parsed and moved."""
    count = 0

    def trace(frame, *_):
        nonlocal count
        if frame.f_code.co_filename != joints.__file__:
            return None
        count += 1
        return trace

    sys.settrace(trace)
    try:
        robot = parsed(*chain(length))
        robot.edges({f'j{length - 1}': 2.0})
    finally:
        sys.settrace(None)
    return count


def test_chain_costs_in_proportion_to_its_length():
    assert lines_run(400) < 5 * lines_run(100)


def test_chain_is_followed_to_its_end():
    slides = [pose[0] for pose in parsed(*chain(5)).edges({'j4': 3.0}).values()]
    assert slides == [3.0, -2.0, 3.0, -2.0, 3.0]


def fast():
    return parsed(joint('k', 'prismatic', 'a', 'b'),
                  joint('m', 'revolute', 'b', 'c', '<mimic joint="k" multiplier="10"/>'))


@pytest.mark.parametrize('position', [1e308, -1e308])
def test_position_too_large_for_the_joint_that_mimics_it_is_refused(position):
    robot, warned = fast(), []
    states = JointStates(robot, lambda kind, sentence: warned.append(sentence))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with pytest.raises(InvalidArgumentException, match='a joint that mimics it is not finite'):
            robot.edges({'k': position})
        assert states.update(0, ('k',), np.array([position])) is None
        assert states.update(1, ('k',), np.array([0.5])) is not None
    assert warned == ['positions that are too large for the joints that mimic them are ignored']
    assert np.isfinite(states.poses()).all()
