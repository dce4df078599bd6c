# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Every method of a history of samples, compared with loops over a list of the same samples.

``test_history`` compares single poses and parents in any order of arrival; here are the methods
that the tree, snapshots, files and the rooms above the core call.
"""

import itertools
import math
import random

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
from policies import HoldNewest
from tf_tree_py.core import ExtrapolationException
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.stamp import FOREVER

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
            for (parent, _, until), (other, since, _) in itertools.pairwise(found):
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
