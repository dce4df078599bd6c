# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

from bisect import bisect_left
import math
import tracemalloc

from effort import examples
from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule, RuleBasedStateMachine
import numpy as np
from policies import HoldNewest
import pytest
from strategies import assert_same_pose
from tf_tree_py.core import (
    ExtrapolationException,
    FutureExtrapolationException,
    NoDataException,
    PastExtrapolationException,
)
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry import se3, so3

SECOND = 1_000_000_000


def pose_number(number):
    """Return a pose that is unique to a number, and not only a translation."""
    return (float(number), 0.5 * number, -float(number), *so3.from_rpy(0.0, 0.1, 0.01 * number))


class NaiveHistory:
    """
    The rules of tf2 on a plain list, newest first, like tf2's own list.

    A sample is refused if it is older than the window, which ends at the newest stamp
    before the arrival. Expired samples are removed when one arrives. Beyond tf2, the newest may be
    held, unless the edge ended at it.
    """

    def __init__(self, cache_time):
        self.cache_time = cache_time
        self.horizon = -math.inf
        self.samples = []
        self.ends = set()
        self.holds_for = 0

    def insert(self, stamp, parent, pose):
        if self.samples:
            self.horizon = self.samples[0][0] - self.cache_time
            self.samples = [sample for sample in self.samples if sample[0] >= self.horizon]
            if stamp < self.horizon:
                return False
        self.ends.discard(stamp)
        place = [kept for kept, _, _ in self.samples if kept > stamp]
        self.samples.insert(len(place), (stamp, parent, pose))
        return True

    def clear(self):
        self.horizon = -math.inf
        self.samples.clear()
        self.ends.clear()

    def sample(self, stamp):
        """Return the parent and the pose, or the error."""
        if not self.samples:
            return NoDataException
        newest = self.samples[0][0]
        if stamp > newest + (0 if newest in self.ends else self.holds_for):
            return FutureExtrapolationException
        if stamp < self.samples[-1][0]:
            return PastExtrapolationException
        place = next(i for i, sample in enumerate(self.samples) if sample[0] <= stamp)
        older_stamp, parent, older = self.samples[place]
        newer_stamp, newer_parent, newer = self.samples[max(place - 1, 0)]
        if older_stamp in self.ends and stamp > older_stamp:
            return ExtrapolationException
        if stamp == older_stamp or parent != newer_parent or place == 0:
            return parent, older
        ratio = (stamp - older_stamp) / (newer_stamp - older_stamp)
        return parent, se3.interpolate(older, newer, ratio)


def answer(history, stamp):
    try:
        pose = history.sample(stamp)
        return history.parent_at(stamp), pose
    except ExtrapolationException as error:
        return type(error)


class HistoryMachine(RuleBasedStateMachine):
    """In any order of arrivals, parents and clears, the packed history equals the naive one."""

    @initialize(cache_time=st.integers(0, 60))
    def begin(self, cache_time):
        self.history = Samples('child', cache_time)
        self.naive = NaiveHistory(cache_time)
        self.count = 0

    @rule(holds_for=st.integers(0, 50))
    def hold_the_newest(self, holds_for):
        self.naive.holds_for = holds_for
        self.history.interpolate_by(HoldNewest(holds_for))
        self.look_at_the_ends()

    @rule()
    def end(self):
        self.history.end()
        if self.naive.samples:
            self.naive.ends.add(self.naive.samples[0][0])
        self.look_at_the_ends()

    def look_at_the_ends(self):
        if self.naive.samples:
            self.look_beside(self.naive.samples[0][0])
            self.look_beside(self.naive.samples[0][0] + self.naive.holds_for)

    def arrive(self, stamp, parent, packed):
        self.count += 1
        was_oldest = self.naive.samples[-1][0] if self.naive.samples else stamp
        pose = pose_number(self.count % 300)
        taken = (packed and parent == self.history.parent
                 and self.history.append(stamp, np.array(pose).tobytes()))
        if not taken:
            taken = self.history.insert(stamp, parent, pose)
        assert taken == self.naive.insert(stamp, parent, pose)
        if self.count % 16 == 0:
            # Samples that have just expired must be gone before the others are read.
            self.compare(was_oldest)

    @rule(stamp=st.integers(-20, 200), parent=st.sampled_from('pppq'), packed=st.booleans())
    def insert_anywhere(self, stamp, parent, packed):
        self.arrive(stamp, parent, packed)
        self.look_beside(stamp)

    @precondition(lambda self: self.naive.samples)
    @rule(back=st.integers(-3, 70), parent=st.sampled_from('pppq'), packed=st.booleans())
    def insert_near_the_newest(self, back, parent, packed):
        stamp = self.naive.samples[0][0] - back
        self.arrive(stamp, parent, packed)
        self.look_beside(stamp)

    @precondition(lambda self: self.naive.samples)
    @rule(data=st.data(), parent=st.sampled_from('pppq'))
    def insert_at_a_stamp_that_is_there(self, data, parent):
        stamp, _, _ = data.draw(st.sampled_from(self.naive.samples))
        self.arrive(stamp, parent, False)
        self.look_beside(stamp)

    @rule(count=st.integers(50, 250), step=st.integers(0, 3), parent=st.sampled_from('ppq'),
          packed=st.booleans())
    def insert_a_run(self, count, step, parent, packed):
        """Fill more than the window, so that expired blocks are dropped."""
        begin = self.naive.samples[0][0] if self.naive.samples else 0
        for i in range(count):
            self.arrive(begin + step * i, parent, packed)

    @rule()
    def clear(self):
        self.history.clear()
        self.naive.clear()

    @rule(stamp=st.integers(-30, 300))
    def look_anywhere(self, stamp):
        self.compare(stamp)

    @precondition(lambda self: self.naive.samples)
    @rule(data=st.data())
    def look_beside_a_sample(self, data):
        self.look_beside(data.draw(st.sampled_from(self.naive.samples))[0])

    def look_beside(self, stamp):
        for near in (stamp - 1, stamp, stamp + 1):
            self.compare(near)

    def compare(self, stamp):
        expected, found = self.naive.sample(stamp), answer(self.history, stamp)
        if isinstance(expected, type):
            assert found is expected
            assert self.history.parent_at(stamp) is None
        else:
            assert not isinstance(found, type), f'{found} instead of {expected}'
            assert found[0] == expected[0]
            assert_same_pose(found[1], expected[1], reach=300.0)

    @invariant()
    def ends_are_those_of_the_list(self):
        samples, history = self.naive.samples, self.history
        assert len(history) == len(samples)
        assert history.newest_stamp == (samples[0][0] if samples else None)
        ended = bool(samples) and samples[0][0] in self.naive.ends
        assert history.latest_stamp == (
            samples[0][0] + (0 if ended else self.naive.holds_for) if samples else None)
        assert history.oldest_stamp == (samples[-1][0] if samples else None)
        assert history.parent == (samples[0][1] if samples and not ended else None)
        self.compare(samples[0][0] if samples else 0)

    @invariant()
    def memory_is_in_order(self):
        history = self.history
        stamps, start = history.stamps.tolist(), history.first()
        assert stamps == sorted(stamps)
        assert len(history.poses) == 7 * len(stamps)
        assert history.parents is None or len(history.parents) == len(stamps)
        assert 0 <= start < max(len(stamps), 1)
        # Expired samples are skipped at once, and dropped an eighth of the window later.
        assert bisect_left(stamps, self.naive.horizon - history.cache_time // 8) < 64

    @invariant()
    def one_parent_is_told_apart_from_several(self):
        parents = {parent for _, parent, _ in self.naive.samples}
        if self.history.fixed_parent:
            assert len(parents) <= 1


TestHistoryIsTheNaiveList = HistoryMachine.TestCase
TestHistoryIsTheNaiveList.settings = examples(1, stateful_step_count=25)


# --- the single rules, as readable tests


def history_of(*samples, cache_time=10 * SECOND):
    history = Samples('child', cache_time)
    for sample in samples:
        stamp, number, *parent = sample
        assert history.insert(stamp, *(parent or ['parent']), pose_number(number))
    return history


def test_late_sample_is_inserted_in_order():
    history = history_of((10, 1), (30, 3), (20, 2))
    assert [history.sample(stamp)[0] for stamp in (10, 15, 20, 25, 30)] == [1, 1.5, 2, 2.5, 3]


def test_sample_between_two_is_on_the_line_and_the_arc():
    history = history_of((100, 0), (200, 10))
    assert_same_pose(history.sample(125), se3.interpolate(pose_number(0), pose_number(10), 0.25))


def test_last_arrival_with_a_stamp_is_the_one_found():
    history = history_of((10, 1), (20, 2), (20, 3), (30, 4))
    assert history.sample(20) == pose_number(3)
    assert history_of((20, 2), (20, 3)).sample(20) == pose_number(3)
    assert history_of((20, 2), (20, 3), (30, 4)).sample(20) == pose_number(3)


def test_late_arrival_with_a_stamp_that_is_there_is_the_one_found():
    history = history_of((10, 1), (20, 2), (30, 4), (20, 3))
    assert history.sample(20) == pose_number(3)
    # As in tf2, earlier poses lead to the first of them, and later ones from the last.
    assert history.sample(15)[0] == 1.5
    assert history.sample(25)[0] == 3.5


def test_one_nanosecond_outside_is_extrapolation():
    history = history_of((10, 1), (20, 2))
    with pytest.raises(PastExtrapolationException):
        history.sample(9)
    with pytest.raises(FutureExtrapolationException):
        history.sample(21)


def test_one_sample_answers_only_at_its_own_stamp():
    history = history_of((10, 1))
    assert history.sample(10) == pose_number(1)
    with pytest.raises(PastExtrapolationException):
        history.sample(9)
    with pytest.raises(FutureExtrapolationException):
        history.sample(11)


def test_empty_history_has_no_data():
    history = Samples('child', SECOND)
    for stamp in (0, 1, -1):
        with pytest.raises(NoDataException):
            history.sample(stamp)
        assert history.parent_at(stamp) is None


def test_sample_exactly_at_the_edge_of_the_window_is_kept():
    history = history_of((100, 1), cache_time=10)
    assert history.insert(90, 'parent', pose_number(2))
    assert not history.insert(89, 'parent', pose_number(3))
    assert history.oldest_stamp == 90


def test_window_hangs_on_the_newest_stamp_before_the_arrival():
    history = history_of((100, 1), cache_time=10)
    assert history.insert(200, 'parent', pose_number(2))
    # 100 was the newest stamp before the jump to 200, so the old sample is still there ...
    assert history.oldest_stamp == 100
    # ... until the next arrival, even one that is refused.
    assert not history.insert(100, 'parent', pose_number(3))
    assert history.oldest_stamp == 200


def test_expired_sample_is_gone_for_the_first_who_looks():
    # Memory is cleaned up after an eighth of the window, here at 180: not for the last sample.
    stamps = (100, 105, 180, 185, 189)
    history = history_of(*((stamp, 1) for stamp in stamps), cache_time=80)
    for stamp in (100, 102):
        with pytest.raises(PastExtrapolationException):
            history.sample(stamp)
    history = history_of(*zip(stamps, range(5), 'abcde', strict=True), cache_time=80)
    assert history.parent_at(107) == 'b'
    assert history.parent_at(102) is None


def test_late_sample_leaves_the_window_in_its_turn():
    history = history_of((100, 1), (92, 2), (103, 3), cache_time=10)
    assert history.oldest_stamp == 92
    history.insert(104, 'parent', pose_number(4))
    assert history.oldest_stamp == 100


def test_older_parent_holds_until_the_sample_of_the_newer():
    history = history_of(
        (10, 1, 'table'), (20, 2, 'table'), (30, 3, 'gripper'), (40, 4, 'gripper'))
    assert [history.parent_at(stamp) for stamp in (15, 20, 29, 30, 35)] == [
        'table', 'table', 'table', 'gripper', 'gripper']
    assert history.sample(29) == pose_number(2)
    assert history.sample(15)[0] == 1.5
    assert history.sample(35)[0] == 3.5
    assert not history.fixed_parent


def test_beyond_its_ends_a_history_has_no_parent():
    for history in (history_of((10, 1, 'table'), (20, 2, 'gripper')),
                    history_of((10, 1, 'table'), (20, 2, 'table'))):
        assert history.parent_at(9) is history.parent_at(21) is None
        assert history.parent_at(10) == 'table'
        assert history.parent_at(20) == history.parent


def test_edge_that_has_ended_keeps_its_past_and_has_no_parent_behind_it():
    history = history_of((10, 1), (20, 2))
    history.end()
    assert history.parent is None
    assert [history.parent_at(stamp) for stamp in (10, 15, 20, 21)] == ['parent'] * 3 + [None]
    assert history.sample(15)[0] == 1.5
    with pytest.raises(FutureExtrapolationException, match='parent -> child'):
        history.sample(21)


def test_edge_that_goes_on_after_its_end_leaves_a_gap():
    history = history_of((10, 1), (20, 2))
    history.end()
    history.insert(30, 'parent', pose_number(3))
    history.insert(40, 'parent', pose_number(4))
    assert history.parent == 'parent'
    with pytest.raises(ExtrapolationException, match='had ended at that time'):
        history.sample(25)
    assert [history.parent_at(stamp) for stamp in (20, 25, 30, 35)] == [
        'parent', None, 'parent', 'parent']
    assert history.sample(35)[0] == 3.5
    assert list(history.parents_between(12, 50)) == [
        ('parent', 10, 21), ('parent', 30, 2 ** 63)]
    # A sample at exactly the stamp of an end revokes the end.
    history.end()
    history.insert(40, 'parent', pose_number(5))
    assert history.parent == history.parent_at(40) == 'parent'
    assert list(history.parents_between(35, 50)) == [('parent', 30, 2 ** 63)]


def test_end_that_left_the_window_is_forgotten():
    history = history_of((10, 1), cache_time=100)
    history.end()
    for stamp in range(20, 400):
        history.insert(stamp, 'parent', pose_number(stamp))
    assert history.fixed_parent


def test_end_that_expired_is_not_among_the_columns():
    history = history_of((10, 1), cache_time=100)
    history.end()
    for stamp in (50, 150, 160):
        history.insert(stamp, 'parent', pose_number(stamp))
    assert history.columns().stamps.tolist() == [50, 150, 160]
    assert not history.columns().ends


def test_end_at_the_oldest_sample_outlives_those_before_it():
    history = history_of(*((stamp, stamp) for stamp in range(70)), cache_time=100)
    history.end()
    for stamp in (169, 170):
        history.insert(stamp, 'parent', pose_number(stamp))
    assert history.stamps.tolist() == [69, 169, 170]
    assert [history.parent_at(stamp) for stamp in (69, 70, 169)] == ['parent', None, 'parent']


def test_end_that_is_revoked_remains_in_a_copy():
    history = history_of((10, 1), (20, 2))
    history.end()
    history.insert(30, 'parent', pose_number(3))
    twin = history.copy()
    history.insert(20, 'parent', pose_number(2))
    assert (history.parent_at(25), twin.parent_at(25)) == ('parent', None)


def test_part_joins_the_samples_that_the_whole_joins():
    history = history_of((10, 1), (20, 2))
    history.end()
    for stamp, parent in ((30, 'parent'), (40, 'parent'), (50, 'other'), (60, 'other')):
        history.insert(stamp, parent, pose_number(stamp))
    few, place = history.part(2, 30, beside=2)
    assert (few.stamps.tolist(), place) == ([10, 20, 30, 40, 50, 60], 2)
    assert [few.joins(number) for number in range(6)] == [True, False, True, False, True, False]


@pytest.mark.parametrize(('stamps', 'latest_that_is_no_silence'), [
    ((0,), 3 * SECOND),  # its period is unknown
    ((0, SECOND // 100), SECOND + SECOND // 100),
    ((0, 2 * SECOND), 8 * SECOND),  # three periods
    ((0, 4 * SECOND), 14 * SECOND),  # the window
])
def test_edge_is_silent_after_a_second_and_three_periods(
        stamps, latest_that_is_no_silence):
    history = history_of(*((stamp, 1) for stamp in stamps))
    assert not history.fell_silent(latest_that_is_no_silence)
    assert history.fell_silent(latest_that_is_no_silence + 1)
    history.end()
    assert not history.fell_silent(100 * SECOND)


def test_history_has_one_parent_again_when_the_other_has_expired():
    history = history_of((0, 0, 'table'), cache_time=100)
    for stamp in range(1, 400):
        history.insert(stamp, 'gripper', pose_number(stamp))
    assert history.fixed_parent
    assert history.parent == 'gripper'


def test_stamp_zero_is_a_time():
    history = history_of((-10, 1), (0, 2), (10, 3))
    assert history.sample(0) == pose_number(2)
    assert history.parent_at(0) == 'parent'
    assert history.sample(5)[0] == 2.5
    assert history.sample(-5)[0] == 1.5


def test_interpolation_takes_the_short_way_whatever_the_signs():
    history = Samples('child', SECOND)
    quarter = so3.from_rpy(0.0, 0.0, math.pi / 2)
    history.insert(0, 'parent', se3.IDENTITY)
    history.insert(10, 'parent', (0.0, 0.0, 0.0, *(-value for value in quarter)))
    assert_same_pose(history.sample(5), (0.0, 0.0, 0.0, *so3.from_rpy(0.0, 0.0, math.pi / 4)))


def test_appending_packed_floats_is_inserting():
    history = history_of((10, 1))
    assert history.append(20, np.array(pose_number(2)).tobytes())
    assert history.sample(20) == pose_number(2)
    assert history.sample(15)[0] == 1.5


def test_append_leaves_other_cases_alone():
    packed = np.array(pose_number(5)).tobytes()
    for history in (Samples('child', SECOND), history_of((10, 1, 'a'), (20, 2, 'b')),
                    StaticHistory('child', 'parent', se3.IDENTITY)):
        before = len(history), history.latest_stamp
        assert not history.append(30, packed)
        assert (len(history), history.latest_stamp) == before
    late = history_of((10, 1))
    assert not late.append(9, packed)
    assert late.append(10, packed)


def test_error_carries_the_edge_and_its_span():
    history = history_of((10, 1), (20, 2))
    with pytest.raises(FutureExtrapolationException) as future:
        history.sample(25)
    error = future.value
    assert (error.parent, error.child) == ('parent', 'child')
    assert (error.requested, error.oldest, error.latest) == (25, 10, 20)


def test_parents_that_may_still_turn_up_are_those_that_were_named():
    history = history_of((90, 1, 'table'), (100, 2, 'gripper'), cache_time=20)
    assert history.possible_parents(95) == {'table'}
    assert history.possible_parents(101) == {'table', 'gripper'}
    # A late sample is accepted up to the edge of the window, and not beyond.
    assert history.possible_parents(80) == {'table', 'gripper'}
    assert history.possible_parents(79) == set()
    with pytest.raises(PastExtrapolationException, match='longer cache_time'):
        history.sample(79)
    assert Samples('child', 20).possible_parents(5) is None


def test_next_turn_is_when_a_stamp_is_reached_or_leaves_the_window():
    history = history_of((90, 1), (100, 2), cache_time=20)
    assert history.next_turn(105) == 105
    assert history.next_turn(95) == history.next_turn(90) == 90 + 20 + 1
    assert history.next_turn(80) == 101
    assert history.next_turn(79) == 2 ** 63
    # Expired samples are removed with the next sample, whatever its stamp.
    history.insert(120, 'parent', pose_number(3))
    assert history.next_turn(95) == 120


def test_static_edge_is_the_same_at_all_times():
    history = StaticHistory('child', 'parent', pose_number(1), 'calibration')
    assert len(history) == 1
    for stamp in (0, -5, 10 ** 18):
        assert history.sample(stamp) == pose_number(1)
        assert history.parent_at(stamp) == 'parent'


def test_sample_costs_72_bytes_and_the_slack_of_two_arrays():
    count = 10_000
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        history = Samples('child', count)
        for stamp in range(4 * count):
            history.insert(stamp, 'parent', se3.IDENTITY)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert count <= len(history) <= count + 2
    # An array grows by a sixteenth beyond the required size.
    assert (after - before) / len(history) < 72 * 17 / 16 + 1


def test_last_of_several_samples_with_the_oldest_stamp_answers_too():
    """tf2 returns the first of them there, and the last everywhere else."""
    history = history_of((10, 1), (10, 2), (20, 3))
    assert history.sample(10) == pose_number(2)
