# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Every method of a history of samples, compared with loops over a list of the same samples.

``test_history`` compares single poses and parents in any order of arrival; here are the methods that
the tree, snapshots, files and the rooms above the core call.
"""

import math
import random

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
from policies import HoldNewest
import pytest
from tf_tree_py.core import ExtrapolationException, InvalidArgumentException, Linear
from tf_tree_py.core.edges.samples import interpolated, Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.edges.tracks import HeldTrack, InterpolatedTrack
from tf_tree_py.core.stamp import BEGINNING, FOREVER

STAMPS = range(-3, 48)


def pose_number(number):
    return (float(number), -2.0 * number, 0.5, 0.0, 0.0, math.sin(number), math.cos(number))


class Listed:
    """All samples in order of time, with those that have expired; fewer than are ever removed."""

    def __init__(self, cache_time, holds_for):
        self.cache_time, self.holds_for = cache_time, holds_for
        self.samples, self.ends = [], set()
        self.horizon, self.fixed = -math.inf, True

    def insert(self, stamp, parent, pose):
        if self.samples:
            self.horizon = self.newest - self.cache_time
            if stamp < self.horizon:
                return False
            self.fixed = self.fixed and parent == self.samples[0][1]
        self.ends.discard(stamp)
        place = sum(kept <= stamp for kept, *_ in self.samples)
        self.samples.insert(place, (stamp, parent, pose))
        return True

    def end(self):
        if self.samples:
            self.ends.add(self.newest)
            self.fixed = False

    @property
    def newest(self):
        return self.samples[-1][0]

    @property
    def ended(self):
        return self.newest in self.ends

    @property
    def parent(self):
        return None if not self.samples or self.ended else self.samples[-1][1]

    @property
    def latest(self):
        return self.newest + (0 if self.ended else self.holds_for)

    @property
    def first(self):
        return sum(stamp < self.horizon for stamp, *_ in self.samples)

    def index_at(self, stamp):
        if not self.samples or stamp > self.latest:
            return None
        before = [i for i in range(self.first, len(self.samples)) if self.samples[i][0] <= stamp]
        if not before or (stamp > self.samples[before[-1]][0] in self.ends):
            return None
        return before[-1]

    def parent_at(self, stamp):
        index = self.index_at(stamp)
        return None if index is None else self.samples[index][1]

    def next_stamp(self, stamp):
        return min((kept for kept, *_ in self.samples[self.first:] if kept > stamp),
                   default=FOREVER)

    def is_too_old(self, stamp):
        return bool(self.samples) and stamp < self.newest - self.cache_time

    def possible_parents(self, stamp):
        if not self.samples:
            return None
        if self.parent_at(stamp) is not None:
            return {self.parent_at(stamp)}
        return set() if self.is_too_old(stamp) else {parent for _, parent, _ in self.samples}

    def joins(self, index):
        if index + 1 == len(self.samples):
            return False
        (a, parent, _), (b, other, _) = self.samples[index:index + 2]
        return a != b and parent == other and a not in self.ends

    def owner(self, stamp):
        """Return the parent at a stamp; the newest remains it unless the edge has ended."""
        before = [each for each in self.samples[self.first:] if each[0] <= stamp]
        if not before or (before[-1][0] in self.ends and stamp > before[-1][0]):
            return None
        return before[-1][1]


def make(seed):
    """Return a history and its list, after the same random arrivals."""
    chosen = random.Random(seed)
    cache_time, holds_for = chosen.choice([0, 7, 15, 100]), chosen.choice([0, 0, 4])
    history = Samples('child', cache_time, 'authority')
    if holds_for:
        history.interpolate_by(HoldNewest(holds_for))
    listed = Listed(cache_time, holds_for)
    several = chosen.random() < 0.6
    for number in range(chosen.choice([0, 1, 2, 3, 7, 25])):
        stamp = chosen.randint(0, 40)
        if chosen.random() < 0.6 and listed.samples:
            stamp = listed.newest + chosen.randint(0, 3)
        parent = chosen.choice('pppq') if several else 'p'
        pose = pose_number(number)
        assert history.insert(stamp, parent, pose) == listed.insert(stamp, parent, pose)
        if several and chosen.random() < 0.15:
            history.end()
            listed.end()
    return history, listed


def outcome(history, stamp):
    try:
        return history.sample(stamp)
    except ExtrapolationException as error:
        return (type(error), error.parent, error.child, error.requested, error.oldest,
                error.latest, error.hint)


def state(history):
    """Return all that lookups can see of a history."""
    return (len(history), history.child, history.parent, history.authority, history.cache_time,
            history.newest_stamp, history.latest_stamp, history.oldest_stamp,
            history.fixed_parent, *[outcome(history, stamp) for stamp in STAMPS],
            *[history.parent_at(stamp) for stamp in STAMPS])


SEEDS = st.integers(0, 10_000)


@examples(4)
@given(SEEDS)
def test_every_answer_at_a_stamp_is_that_of_the_list(seed):
    history, listed = make(seed)
    assert (history.fixed_parent, history.parent) == (listed.fixed, listed.parent)
    assert len(history) == len(listed.samples) - listed.first
    for stamp in STAMPS:
        assert history.parent_at(stamp) == listed.parent_at(stamp)
        assert history.index_at(stamp) == listed.index_at(stamp)
        assert history.next_stamp(stamp) == listed.next_stamp(stamp)
        assert history.is_too_old(stamp) == listed.is_too_old(stamp)
        assert history.possible_parents(stamp) == listed.possible_parents(stamp)
        before = sum(kept <= stamp for kept, *_ in listed.samples) - 1
        assert history.index_before(stamp) == max(listed.first, before)
        for parent in 'pq':
            assert history.continues(parent, stamp, pose_number(0)) == (
                listed.fixed and parent == listed.parent
                and stamp >= listed.samples[listed.first][0])
    for parent in 'pqx':
        assert history.has_named(parent) == (parent in {each[1] for each in listed.samples})
    for index, (_, _, pose) in enumerate(listed.samples):
        assert history.pose(index) == pose
        assert history.joins(index) == listed.joins(index)


@examples(2)
@given(SEEDS)
def test_neighbours_are_two_samples_without_another_between(seed):
    history, listed = make(seed)
    stamps = [stamp for stamp, *_ in listed.samples[listed.first:]]
    for first in STAMPS:
        for last in range(first + 1, first + 9):
            between = any(first < stamp < last for stamp in stamps)
            found = history.neighbours(first, last)
            if between or None in (listed.parent_at(first), listed.parent_at(last)):
                assert found is None
            else:
                assert found == history.sample(first) + history.sample(last)


@examples(4)
@given(SEEDS)
def test_parents_between_are_those_of_each_nanosecond(seed):
    history, listed = make(seed)
    for begin in range(-3, 45, 4):
        for end in range(begin, begin + 12):
            found = list(history.parents_between(begin, end))
            for stamp in range(begin, end):
                owners = [parent for parent, since, until in found if since <= stamp < until]
                owner = listed.owner(stamp)
                assert owners == ([] if owner is None else [owner])
            # They are in order; none is empty, or could be joined to the one before it.
            for (parent, _, until), (other, since, _) in zip(found, found[1:]):
                assert until < since or (until == since and parent != other)
            assert all(since < until for _, since, until in found)


@examples(4)
@given(SEEDS)
def test_copies_answer_as_the_original(seed):
    history, listed = make(seed)
    expected = state(history)
    twin = history.copy()
    assert type(twin) is Samples
    assert twin.interpolation is history.interpolation
    assert state(twin) == expected
    # They are independent.
    twin.insert(60, 'z', pose_number(9))
    assert state(history) == expected
    columns = history.columns()
    kept = listed.samples[listed.first:]
    assert columns.stamps.tolist() == [stamp for stamp, *_ in kept]
    assert columns.poses.tolist() == [number for *_, pose in kept for number in pose]
    assert columns.parents == (None if listed.fixed else [parent for _, parent, _ in kept])
    assert columns.ends == {end for end in listed.ends if end >= kept[0][0]}
    laid = Samples('child', history.cache_time, 'authority')
    laid.lie_on(columns, history.parent)
    laid.interpolate_by(history.interpolation)
    for stamp in STAMPS:
        # An expired sample is not in the columns.
        assert laid.parent_at(stamp) == history.parent_at(stamp)
        if history.parent_at(stamp) is not None:
            assert laid.sample(stamp) == history.sample(stamp)
    assert (laid.parent, laid.newest_stamp, laid.latest_stamp, laid.fixed_parent) == (
        history.parent, history.newest_stamp, history.latest_stamp, history.fixed_parent)


@examples(2)
@given(SEEDS)
def test_part_has_the_samples_around_two_stamps(seed):
    history, listed = make(seed)
    for index in range(listed.first, len(listed.samples)):
        for last in range(listed.samples[index][0], 44, 5):
            for beside in range(3):
                few, place = history.part(index, last, beside)
                begin = max(listed.first, index - beside)
                end = sum(stamp <= last for stamp, *_ in listed.samples) + 1 + beside
                part = listed.samples[begin:end]
                assert place == index - begin
                assert few.stamps.tolist() == [stamp for stamp, *_ in part]
                assert few.parents == (None if listed.fixed else [each[1] for each in part])
                for number, (*_, pose) in enumerate(part):
                    assert few.pose(number) == pose
                    assert few.joins(number) == (number + 1 < len(part)
                                                 and listed.joins(begin + number))
                assert (few.child, few.cache_time, few.authority, few.parent, few.newest_stamp,
                        few.latest_stamp) == (
                    'child', history.cache_time, 'authority', history.parent,
                    history.newest_stamp, history.latest_stamp)


@examples(2)
@given(SEEDS)
def test_copy_between_has_the_samples_that_surround_two_stamps(seed):
    history, listed = make(seed)
    if not listed.samples:
        return
    for first in STAMPS:
        for last in range(first, 48, 4):
            stamps, poses = history.copy_between(first, last)
            begin = max(listed.first, sum(kept <= first for kept, *_ in listed.samples) - 1)
            end = max(begin, sum(kept <= last for kept, *_ in listed.samples)) + 1
            assert stamps.tolist() == [kept for kept, *_ in listed.samples[begin:end]]
            assert poses.tolist() == [list(pose) for *_, pose in listed.samples[begin:end]]
    # They are copies: as long as there is a view, no sample can be added.
    history.insert(60, 'p', pose_number(1))


@examples(6)
@given(st.sampled_from([0, 3, 12, 100]), st.lists(st.integers(0, 40), min_size=1, max_size=4),
       st.lists(st.lists(st.integers(0, 40), min_size=1, max_size=9), min_size=1, max_size=3))
def test_extending_is_inserting_one_by_one(cache_time, begun, tracks):
    one, whole = Samples('child', cache_time), Samples('child', cache_time)
    number = 0
    for history in (one, whole):
        for stamp in begun:
            history.insert(stamp, 'p', pose_number(stamp))
    for track in tracks:
        stamps, poses, newest, late = [], [], whole.newest_stamp, whole.late
        for stamp in track:
            number += 1
            # Those that are too old in their turn are left out by the caller.
            if one.insert(stamp, 'p', pose_number(number)):
                stamps.append(stamp)
                poses.append(pose_number(number))
        if stamps:
            whole.extend(np.array(stamps), np.array(poses))
        # What was learnt before is out of date only if a sample is older than the newest of then.
        assert whole.late == min([late, *[stamp for stamp in stamps if stamp < newest]])
        if len(stamps) == len(track):
            assert state(whole) == state(one)
            first = whole.first()
            assert whole.stamps.tolist()[first:] == one.stamps.tolist()[one.first():]
            assert whole.poses.tolist()[7 * first:] == one.poses.tolist()[7 * one.first():]
            assert [whole.index_at(stamp) for stamp in STAMPS] == [
                one.index_at(stamp) for stamp in STAMPS]


# --- by hand


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
    assert state(history)[1:] == state(Samples('child', 15))[1:]
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


def test_appended_sample_is_the_newest_with_or_without_its_floats():
    for unpacked in (None, pose_number(2)):
        history = history_of((10, 'p'))
        assert history.append(20, np.array(pose_number(2)).tobytes(), unpacked)
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
