# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The pose of the newest sample of each edge, whatever their stamps."""

from hand_clock import HandClock
import numpy as np
import pytest
from tf_tree_py import (
    BufferCore,
    ConstantTwist,
    ExtrapolationException,
    LATEST,
    Linear,
    load,
    Pose,
    StaleException,
)

S = 1_000_000_000
MS = 1_000_000
NOW = 1_700_000_000 * S
FIRST = Pose(1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8)
SECOND = Pose(4.0, -1.0, 0.5, 0.48, 0.0, 0.36, 0.8)
THIRD = Pose(-2.0, 0.3, 7.0, 0.0, 0.0, 0.6, 0.8)


def arm_on_a_base(**options):
    """Return a base of 10 Hz, and an arm of 200 Hz that is still; all turn."""
    buffer = BufferCore(now=HandClock(NOW), **options)
    for age, pose in (190 * MS, SECOND), (90 * MS, FIRST):
        buffer.insert('map', 'base', NOW - age, pose)
    for number in range(41):
        buffer.insert('base', 'arm', NOW - (40 - number) * 5 * MS,
                      THIRD if number == 40 else SECOND)
    buffer.insert('arm', 'tool', 0, SECOND, static=True)
    buffer.insert('map', 'table', 0, THIRD, static=True)
    return buffer


def test_a_fast_edge_is_not_held_back_by_a_slow_one():
    buffer = arm_on_a_base()
    newest = buffer.lookup_newest('map', 'tool')
    assert newest.stamps == {'base': NOW - 90 * MS, 'arm': NOW}
    assert newest.oldest == NOW - 90 * MS
    assert newest.pose == FIRST @ THIRD @ SECOND
    # The latest common time is that of the base, when the arm was elsewhere.
    assert buffer.lookup('map', 'tool') == FIRST @ SECOND @ SECOND


def test_up_one_branch_and_down_the_other():
    newest = arm_on_a_base().lookup_newest('tool', 'table')
    assert set(newest.stamps) == {'base', 'arm'}
    np.testing.assert_allclose(
        newest.pose, (FIRST @ THIRD @ SECOND).inverse() @ THIRD, atol=1e-12)
    back = arm_on_a_base().lookup_newest('table', 'tool')
    np.testing.assert_allclose(back.pose @ newest.pose, Pose(), atol=1e-12)


def test_where_nothing_moves_there_are_no_stamps():
    newest = arm_on_a_base().lookup_newest('arm', 'tool')
    assert (newest.pose, newest.stamps, newest.oldest) == (SECOND, {}, LATEST)


def test_with_one_time_it_is_the_latest():
    buffer = BufferCore()
    for child, parent in ('base', 'map'), ('arm', 'base'):
        for stamp in (5, 9):
            buffer.insert(parent, child, stamp, FIRST)
    assert buffer.lookup_newest('map', 'arm').pose == buffer.lookup('map', 'arm')


def test_edges_without_a_common_time_have_an_answer():
    buffer = BufferCore()
    buffer.insert('map', 'base', 5, FIRST)
    buffer.insert('base', 'arm', 9, SECOND)
    with pytest.raises(ExtrapolationException):
        buffer.lookup('map', 'arm')
    assert buffer.lookup_newest('map', 'arm') == (FIRST @ SECOND, {'base': 5, 'arm': 9})


def test_a_frame_with_a_new_parent_is_where_it_is_now():
    buffer = arm_on_a_base()
    buffer.insert('table', 'cup', NOW - 50 * MS, FIRST)
    buffer.insert('tool', 'cup', NOW - 10 * MS, SECOND)
    assert buffer.lookup_newest('tool', 'cup').pose == SECOND
    newest = buffer.lookup_newest('map', 'cup')
    assert newest.stamps == {'base': NOW - 90 * MS, 'arm': NOW, 'cup': NOW - 10 * MS}
    np.testing.assert_allclose(newest.pose, FIRST @ THIRD @ SECOND @ SECOND, atol=1e-12)


def test_the_limit_is_for_each_edge():
    buffer = arm_on_a_base()
    assert buffer.lookup_newest('map', 'tool', max_age=90 * MS)
    with pytest.raises(StaleException, match='edge map -> base.*\n.*base -> arm 0 ns'):
        buffer.lookup_newest('map', 'tool', max_age=90 * MS - 1)
    assert buffer.lookup_newest('base', 'tool', max_age=0)
    with pytest.raises(StaleException):
        arm_on_a_base(max_age=90 * MS - 1).lookup_newest('map', 'tool')


class Hold(Linear):
    """Holds the newest sample for 80 ms."""

    holds_for = 80 * MS


def test_an_edge_that_holds_its_sample_gets_older_only_after_that():
    buffer = arm_on_a_base()
    buffer.set_interpolation('base', Hold())
    assert buffer.lookup_newest('map', 'tool', max_age=10 * MS).stamps['base'] == NOW - 90 * MS
    assert buffer.lookup('map', 'tool', max_age=10 * MS) == FIRST @ SECOND @ SECOND
    with pytest.raises(StaleException, match='edge map -> base, .* is 10 ms old'):
        buffer.lookup('map', 'tool', max_age=9 * MS)
    with pytest.raises(StaleException, match='edge map -> base'):
        buffer.lookup_newest('map', 'tool', max_age=9 * MS)


@pytest.mark.parametrize('lookup', [BufferCore.lookup, BufferCore.lookup_newest])
def test_where_all_edges_hold_their_samples_the_first_that_does_no_more_is_too_old(lookup):
    clock = HandClock(NOW)
    buffer = BufferCore(now=clock)
    buffer.insert('map', 'base', NOW - 70 * MS, FIRST)
    buffer.insert('base', 'arm', NOW - 50 * MS, SECOND)
    for child in 'base', 'arm':
        buffer.set_interpolation(child, Hold())
    assert lookup(buffer, 'map', 'arm', max_age=0)
    clock.now += 25 * MS
    assert lookup(buffer, 'map', 'arm', max_age=15 * MS)
    with pytest.raises(StaleException, match='edge map -> base, .* is 15 ms old') as caught:
        lookup(buffer, 'map', 'arm', max_age=14 * MS)
    assert [tuple(edge[3:]) for edge in caught.value.ages] == [
        (NOW - 70 * MS, 15 * MS), (NOW - 50 * MS, -5 * MS)]
    assert caught.value.blocked_on == (('base', NOW + 11 * MS),)


def test_of_a_curve_it_is_the_pose_of_now_or_its_end():
    path = ConstantTwist(NOW - S, NOW + S, FIRST, (1.0, 0.0, 0.0, 0.0, 0.0, 0.5))
    buffer = BufferCore(now=HandClock(NOW))
    buffer.insert_curve('map', 'ball', path)
    newest = buffer.lookup_newest('map', 'ball', max_age=0)
    assert newest == (buffer.lookup('map', 'ball', NOW), {'ball': NOW})
    old = BufferCore(now=HandClock(NOW + 3 * S))
    old.insert_curve('map', 'ball', path)
    assert old.lookup_newest('map', 'ball').stamps == {'ball': NOW + S}
    early = BufferCore(now=HandClock(NOW - 3 * S))
    early.insert_curve('map', 'ball', path)
    assert early.lookup_newest('map', 'ball').stamps == {'ball': NOW - S}
    without_clock = BufferCore()
    without_clock.insert_curve('map', 'ball', path)
    assert without_clock.lookup_newest('map', 'ball').stamps == {'ball': NOW + S}


def test_a_snapshot_and_a_file_have_the_same_answer(tmp_path):
    buffer, path = arm_on_a_base(), tmp_path / 'run.tftree'
    buffer.save(path)
    newest = buffer.lookup_newest('map', 'tool')
    assert buffer.snapshot().lookup_newest('map', 'tool') == newest
    assert load(path).lookup_newest('map', 'tool') == newest


def test_a_cleared_edge_has_no_newest_sample():
    buffer = arm_on_a_base()
    buffer.clear()
    with pytest.raises(Exception, match='clear'):
        buffer.lookup_newest('map', 'tool')
