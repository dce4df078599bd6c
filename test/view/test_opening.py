# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The initial moment of a bag, the content of an address, and the relative motion of frames."""

from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.view.model.facts import measured, relative_motion, rows
from tf_tree_py.view.model.playhead import IncidentLog, opening_stamp, time_of
from tf_tree_py.view.page.controls import ViewLink

SECOND = 1_000_000_000


@pytest.fixture
def tree():
    """Return a robot whose localisation starts two seconds after its wheels."""
    buffer = BufferCore(UNLIMITED)
    for tenth in range(10, 101):
        stamp = tenth * SECOND // 10
        buffer.insert('odom', 'base', stamp, Pose(x=tenth / 10.0), strict=False)
        buffer.insert('base', 'wheel', stamp, Pose.from_xyz_rpy(y=0.2, yaw=tenth / 5.0),
                      strict=False)
        if tenth >= 30:
            buffer.insert('map', 'odom', stamp, Pose(), strict=False)
    for number in range(5):
        buffer.insert('base', f'bumper_{number}', 0, Pose(x=number), static=True)
    return buffer


def test_bag_opens_when_most_frames_reach_the_root(tree):
    assert opening_stamp(tree.edges()) == 3 * SECOND
    alone = BufferCore(UNLIMITED)
    alone.insert('a', 'b', 0, Pose(), static=True)
    assert opening_stamp(alone.edges()) is None
    assert opening_stamp([]) is None


frame_names = st.none() | st.text(min_size=1).filter(
    lambda name: name.encode(errors='ignore').decode() == name)


@given(st.none() | st.integers(1, 9_999_999_999 * SECOND), frame_names, frame_names,
       st.booleans(), st.none() | st.lists(st.floats(-1e4, 1e4), min_size=6, max_size=6))
def test_address_keeps_what_is_shown(stamp, fixed_frame, chosen, dark, camera):
    wanted = None
    if camera is not None:
        wanted = np.array(camera).reshape(2, 3)
        wanted[1] += 0.001 + np.abs(wanted[0] - wanted[1]).max() == 0.001
    link = ViewLink(stamp, fixed_frame, chosen, wanted, dark)
    assert all(letter.isalnum() or letter in '=&_.~/-' for letter in link.query())
    back = ViewLink.parse('?' + link.query())
    assert (back.stamp, back.fixed_frame, back.chosen, back.dark) == (
        stamp, fixed_frame, chosen, dark)
    if wanted is None:
        assert back.camera is None
    elif back.camera is not None:
        np.testing.assert_allclose(back.camera, wanted, atol=1e-4)


@pytest.mark.parametrize('query', [
    '', '?t=x&camera=1_2_3&chosen=&dark=2', '?t=-5&camera=nan_1_1_1_1_1', '?t=1e9&fixed=',
    '?camera=1_1_1_1_1_1', '?t=' + '9' * 40])
def test_address_that_is_wrong_is_left_out(query):
    assert ViewLink.parse(query) == ViewLink()


def test_static_subtrees_fold_and_a_search_unfolds_them(tree):
    folded = rows(tree.edges(), unfolded=set())
    assert [row.frame for row in folded if row.folds is None] == ['map', 'odom', 'base', 'wheel']
    fold, = (row for row in folded if row.folds is not None)
    assert (fold.frame, fold.folds) == ('base', '▸ 5 static on base')
    open_rows = rows(tree.edges(), unfolded={'base'})
    assert sum(row.folds is None for row in open_rows) == 9
    assert 'bumper_3' in [row.frame for row in rows(tree.edges(), 'bumper_3', set())]
    still = [edge for edge in tree.edges() if edge.static]
    assert all(row.folds is None for row in rows(still, unfolded=set()))


def test_motion_of_one_frame_in_another_is_measured(tree):
    motion = relative_motion(tree, 'odom', 'wheel', SECOND, 10 * SECOND)
    np.testing.assert_allclose(motion.positions[:, 0], motion.stamps / SECOND, atol=1e-9)
    # Eighteen radians, without a jump of a full turn.
    np.testing.assert_allclose(np.ptp(motion.angles[:, 2]), np.degrees(18.0), atol=1e-6)
    facts = dict(measured(tree.lookup('odom', 'wheel', 5 * SECOND), motion))
    assert facts['distance'] == f'{np.hypot(5.0, 0.2):.4f} m'
    assert facts['distance in the window'].endswith(f'{np.hypot(10.0, 0.2):.4f} m')
    gap = relative_motion(tree, 'map', 'base', SECOND, 10 * SECOND)
    assert np.isnan(gap.positions[gap.stamps < 3 * SECOND]).all()
    assert relative_motion(tree, 'odom', 'nowhere', SECOND, 10 * SECOND) is None
    assert dict(measured(None, None)) == {'now': 'unknown at this stamp'}


def test_finding_has_the_time_of_its_incident_or_its_gap(tree):
    log = IncidentLog()
    tree.observers.add(log)
    finding = Finding('made-up', Severity.WARNING, ('odom', 'base'), (), 'It is odd.')
    assert time_of(finding, tree, log) is not None
    tree.insert('odom', 'base', 12 * SECOND, Pose(x=12.0), strict=False)
    assert time_of(finding, tree, log) == 10 * SECOND
    tree.insert('base', 'odom', 13 * SECOND, Pose(), strict=False)  # a loop is refused
    assert time_of(finding, tree, log) == 13 * SECOND and log.stamps() == [13 * SECOND]
    assert time_of(Finding('x', Severity.NOTE, ('nobody',), (), ''), tree, log) is None
