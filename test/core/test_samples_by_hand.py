# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The methods of a history of samples, each in whole results worked out by hand."""

import contextlib
import copy
import math

import numpy as np
from policies import HoldNewest
import pytest
from tf_tree_py.core import ExtrapolationException, InvalidArgumentException, Linear
from tf_tree_py.core.edges.samples import interpolated, Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.edges.tracks import HeldTrack, InterpolatedTrack
from tf_tree_py.core.stamp import BEGINNING, FOREVER


def pose_number(number):
    return (float(number), -2.0 * number, 0.5, 0.0, 0.0, math.sin(number), math.cos(number))


def history_of(*samples, cache_time=1000):
    """Return a history of samples (stamp, parent), whose poses have the numbers 0, 1, 2."""
    history = Samples('child', cache_time)
    for number, (stamp, parent) in enumerate(samples):
        assert history.insert(stamp, parent, pose_number(number))
    return history


def test_new_history_is_empty():
    history = Samples('child', 5)
    assert (len(history), history.child, history.cache_time, history.authority, history.parent,
            history.newest_stamp, history.latest_stamp, history.oldest_stamp, history.late) == (
        0, 'child', 5, '', None, None, None, None, FOREVER)
    assert history.fixed_parent
    assert (history.first(), history.index_at(0), history.next_stamp(0)) == (0, None, FOREVER)
    assert (history.next_turn(0), history.is_too_old(-9)) == (FOREVER, False)
    assert not history.fell_silent(100)
    assert list(history.parents_between(0, 9)) == []
    assert history.neighbours(0, 1) is None
    history.end()
    assert (history.parent, history.fixed_parent, len(history)) == (None, True, 0)
    with pytest.raises(TypeError, match='Samples has no truth value'):
        bool(history)


def test_history_that_was_cleared_is_as_new():
    history = history_of((10, 'p'), (30, 'q'), (25, 'p'), cache_time=15)
    history.end()
    assert history.late == 25
    history.clear()
    assert (len(history), history.parent, history.newest_stamp, history.latest_stamp,
            history.oldest_stamp, history.fixed_parent, history.parent_at(30)) == (
        0, None, None, None, None, True, None)
    assert history.insert(1, 'p', pose_number(1))
    assert (len(history), history.oldest_stamp, history.fixed_parent) == (1, 1, True)
    assert history.append(2, np.array(pose_number(2)).tobytes())


def test_late_is_the_oldest_stamp_that_came_after_a_newer_one():
    history = history_of((10, 'p'), (20, 'p'), (20, 'p'))
    assert history.late == FOREVER
    for stamp, late in ((15, 15), (18, 15), (12, 12), (30, 12)):
        history.insert(stamp, 'p', pose_number(stamp))
        assert history.late == late
    poses = np.array([pose_number(1), pose_number(2)])
    history = history_of((10, 'p'))
    history.extend(np.array([10, 20]), poses)
    assert history.late == FOREVER
    history.extend(np.array([30, 8]), poses)
    assert (history.late, history.newest_stamp, history.oldest_stamp) == (8, 30, 8)
    history.extend(np.array([9, 40]), poses)
    assert history.late == 8


def test_reading_changes_nothing():
    """Threads may read at once: those of a reader of a shared tree have no lock."""
    history = history_of(*[(stamp, 'p') for stamp in range(0, 200, 10)], cache_time=75)
    slots = {name: getattr(history, name) for cls in Samples.__mro__
             for name in getattr(cls, '__slots__', ())
             if name != 'interpolation' and hasattr(history, name)}
    before = copy.deepcopy(slots)
    for stamp in range(-10, 210, 5):
        with contextlib.suppress(ExtrapolationException):
            history.sample(stamp)
        history.index_at(stamp)
    assert (len(history), history.oldest_stamp) == (9, 110)
    assert slots == before == {name: getattr(history, name) for name in slots}


def test_parents_between_in_whole_tuples():
    history = history_of((10, 'p'), (20, 'p'), (30, 'q'), (30, 'q'), (40, 'p'))
    history.end()
    history.insert(50, 'p', pose_number(1))
    whole = [('p', 10, 30), ('q', 30, 40), ('p', 40, 41), ('p', 50, FOREVER)]
    assert list(history.parents_between(BEGINNING, FOREVER)) == whole
    for begin, end, expected in (
            (0, 10, []), (0, 11, [('p', 10, 20)]), (0, 20, [('p', 10, 20)]),
            (0, 21, [('p', 10, 30)]), (0, 31, [('p', 10, 30), ('q', 30, 40)]),
            (29, 30, [('p', 20, 30)]), (30, 40, [('q', 30, 40)]), (39, 50, [*whole[1:3]]),
            (40, 41, [('p', 40, 41)]), (45, 51, [*whole[2:]]), (60, 70, [*whole[3:]])):
        assert list(history.parents_between(begin, end)) == expected
    fixed = history_of((10, 'p'), (20, 'p'))
    assert list(fixed.parents_between(30, 40)) == [('p', 10, FOREVER)]
    # An expired sample has no time.
    fixed = history_of((10, 'p'), (20, 'p'), (30, 'p'), cache_time=5)
    assert list(fixed.parents_between(0, 1)) == [('p', 20, FOREVER)]


def test_error_has_the_newest_parent_and_the_span():
    history = history_of((10, 'p'), (20, 'q'), (30, 'r'))
    history.end()
    error = history.extrapolation(35)
    assert (error.parent, error.child, error.requested, error.oldest, error.latest) == (
        'r', 'child', 35, 10, 30)
    error = Samples('child', 5).extrapolation(35)
    assert (error.parent, error.child, error.requested, error.oldest, error.latest) == (
        None, 'child', 35, None, None)


def test_next_turn_of_each_stamp():
    history = history_of((10, 'p'), (20, 'p'), cache_time=15)
    history.end()
    history.insert(30, 'p', pose_number(3))
    turns = {
        9: FOREVER,  # older than the window
        10: 30, 14: 30, 15: 30, 19: 30,  # the sample at 10 goes with the next arrival
        20: 20 + 16, 21: 21 + 16, 29: 29 + 16,  # after an end, late samples may come
        30: 30 + 16, 31: 31}
    assert {stamp: history.next_turn(stamp) for stamp in turns} == turns
    history.insert(30, 'p', pose_number(3))
    assert [history.next_turn(stamp) for stamp in (14, 15, 19)] == [FOREVER, 31, 35]


def test_edge_is_silent_after_the_rule_or_the_window():
    second = 10 ** 9
    for stamps, cache_time, longest in (
            ((5,), 9 * second, 3 * second), ((5, 15), 9 * second, second),
            ((-second, second), 99 * second, 6 * second),  # three of its intervals
            ((-second, second), 5 * second, 5 * second)):
        history = history_of(*((stamp, 'p') for stamp in stamps), cache_time=cache_time)
        limit = stamps[-1] + longest
        assert [history.fell_silent(stamp) for stamp in (0, limit, limit + 1)] == [
            False, False, True]
        history.end()
        assert not history.fell_silent(limit + 1)


def test_interpolation_is_asked_for_poses_between_two_samples_of_one_parent():
    class Recorded(Linear):
        """Notes which poses it is asked for."""

        def between(self, samples, index, stamp):
            asked.append((samples, index, stamp))
            return pose_number(7)

    history, asked = history_of((10, 'p'), (20, 'p'), (30, 'q'), (40, 'q')), []
    history.interpolate_by(Recorded())
    assert [history.sample(stamp) for stamp in (10, 15, 20, 25, 30, 31, 40)] == [
        pose_number(number) for number in (0, 7, 1, 1, 2, 7, 3)]
    assert asked == [(history, 0, 15), (history, 2, 31)]
    history.end()
    history.insert(50, 'q', pose_number(4))
    with pytest.raises(ExtrapolationException, match='had ended'):
        history.sample(45)
    history.interpolate_by(Linear())
    for stamp, expected in ((12, 0.2), (19, 0.9), (25, 1.0), (36, 2.6)):
        assert history.sample(stamp)[0] == pytest.approx(expected)
    with pytest.raises(ExtrapolationException, match='had ended'):
        history.sample(45)


def test_interpolation_forgets_when_samples_before_the_newest_change():
    class Noting(Linear):
        """Notes which of its methods are called."""

        def forget(self):
            noted.append('forget')

        def clear(self):
            noted.append('clear')

        def copy(self):
            noted.append('copy')
            return Linear()

    noted = []
    history = history_of((10, 'p'), (20, 'p'))
    history.interpolate_by(Noting())
    packed = np.array([pose_number(1)])
    for change, expected in (
            (lambda: history.insert(30, 'p', pose_number(1)), []),
            (lambda: history.append(40, packed.tobytes()), []),
            (lambda: history.insert(25, 'p', pose_number(1)), ['forget']),
            (lambda: history.extend(np.array([50]), packed), ['forget']),
            (lambda: history.set_poses(np.repeat(packed, 6, axis=0)), ['forget']),
            (lambda: history.copy(), ['copy']), (lambda: history.clear(), ['clear'])):
        noted.clear()
        change()
        assert noted == expected
    assert len(history) == 0


def test_choosing_an_interpolation_makes_or_keeps_the_history():
    class Other(Linear):

        def followed_by(self, other):
            return Last()

    class Last(Linear):
        pass

    new = interpolated(None, 'child', 7, Other())
    assert (type(new), new.child, new.cache_time, len(new)) == (Samples, 'child', 7, 0)
    assert type(new.interpolation) is Other
    assert interpolated(new, 'child', 8, Linear()) is new
    assert (type(new.interpolation), new.cache_time) == (Last, 7)
    static = StaticHistory('child', 'p', pose_number(1))
    with pytest.raises(InvalidArgumentException, match='The edge p -> child is static, and has'):
        interpolated(static, 'child', 7, Linear())


def test_edge_that_holds_its_newest_sample_is_asked_beyond_it():
    history = history_of((10, 'p'), (20, 'p'))
    history.interpolate_by(HoldNewest(5))
    assert history.latest_stamp == 25
    assert history.sample(25) == history.sample(20) == pose_number(1)
    assert history.neighbours(20, 25) == pose_number(1) * 2
    assert history.neighbours(20, 26) is None
    assert type(history.track(12, 20)) is not HeldTrack
    assert type(history.track(12, 21)) is HeldTrack
    assert history.append(30, np.array(pose_number(3)).tobytes())
    assert (history.latest_stamp, history.copy().latest_stamp) == (35, 35)
    # A copy goes on to hold new samples, and the original does, too.
    for each in (history.copy(), history):
        each.insert(40, 'p', pose_number(4))
        assert each.latest_stamp == 45
        each.extend(np.array([50]), np.array([pose_number(5)]))
        assert each.latest_stamp == 55
    history.interpolate_by(Linear())
    assert history.latest_stamp == 50
    # Never up to the end of time, which is no stamp.
    history.interpolate_by(HoldNewest(FOREVER))
    assert history.latest_stamp == FOREVER - 1
    history.end()
    history.interpolate_by(HoldNewest(7))
    assert history.latest_stamp == 50


def test_track_ends_with_a_held_sample_only_beyond_it():
    history = history_of((10, 'p'), (20, 'p'), (30, 'p'))
    track = history.track(12, 30)
    assert type(track) is InterpolatedTrack
    assert track.knots.tolist() == [10, 20, 30]
    assert history.track(21, 29).knots.tolist() == [20, 30]


def test_replaced_poses_are_those_of_the_window():
    history = history_of(*((stamp, 'p') for stamp in (0, 10, 20, 30)), cache_time=15)
    history.insert(31, 'p', pose_number(4))
    assert (history.sample(31), history.first()) == (pose_number(4), 2)
    history.set_poses(np.array([pose_number(number) for number in (7, 8, 9)]))
    assert [history.sample(stamp) for stamp in (20, 30, 31)] == [
        pose_number(number) for number in (7, 8, 9)]
    assert history.copy_between(20, 31)[1].tolist() == [
        list(pose_number(number)) for number in (7, 8, 9)]


def test_appended_sample_is_the_newest():
    history = history_of((10, 'p'))
    assert history.append(20, np.array(pose_number(2)).tobytes())
    assert (history.newest_stamp, history.latest_stamp, len(history)) == (20, 20, 2)
    assert history.sample(20) == pose_number(2)
    assert history.append(20, np.array(pose_number(3)).tobytes())
    assert history.sample(20) == pose_number(3)


def test_append_moves_the_window_as_insert_does():
    packed = np.array(pose_number(1)).tobytes()
    history = history_of((10, 'p'), cache_time=10)
    for stamp, oldest in ((20, 10), (21, 10), (22, 20), (40, 20), (41, 40)):
        assert history.append(stamp, packed)
        assert history.oldest_stamp == oldest


# --- memory


@pytest.mark.parametrize(('cache_time', 'most'), [(0, 65), (63, 129), (800, 910)])
@pytest.mark.parametrize('way', ['insert', 'append', 'extend'])
def test_expired_samples_are_removed_in_blocks(cache_time, most, way):
    history, packed = Samples('child', cache_time), np.array(pose_number(1)).tobytes()
    lengths = []
    history.insert(0, 'p', pose_number(0))
    for stamp in range(1, 2500):
        match way:
            case 'insert':
                history.insert(stamp, 'p', pose_number(1))
            case 'append':
                history.append(stamp, packed)
            case 'extend':
                history.extend(np.array([stamp]), np.array([pose_number(1)]))
        lengths.append(len(history.stamps))
        assert len(history.poses) == 7 * len(history.stamps)
    assert max(lengths) == most
    assert history.sample(2499) == pose_number(1)


@pytest.mark.parametrize('ended', [False, True])
def test_parents_are_stored_only_as_long_as_there_are_several(ended):
    history = history_of(*((stamp, 'q') for stamp in range(64)), cache_time=100)
    history.insert(64, 'p', pose_number(0))
    if ended:
        history.end()
    for stamp in (100, 164):
        history.insert(stamp, 'p', pose_number(stamp))
        assert not history.fixed_parent
    # The last q expires with the sample after the one at 164.
    history.insert(165, 'p', pose_number(1))
    assert history.stamps.tolist() == [64, 100, 164, 165]
    assert history.fixed_parent is not ended
    assert history.parent_at(64) == 'p'
    assert history.parent_at(65) == (None if ended else 'p')
