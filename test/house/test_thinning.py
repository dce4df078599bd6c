# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The samples that thinning sends, compared with the receiver's interpolation."""

from contextlib import contextmanager
import math
from queue import SimpleQueue
import time

from effort import examples
from hypothesis import given, strategies as st
from programs import PATIENCE_S
import pytest
from strategies import about, axes, vectors
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.thinning import DeadBand, MovingSender, Thinner

SECOND = 1_000_000_000
MIN_MOVE, MIN_TURN, SILENCE = 0.01, 0.02, 10


def at(stamp, x=0.0, parent='odom', child='base'):
    return Sample(parent, child, stamp, (x, *IDENTITY[1:]))


def dead_band():
    return DeadBand(MIN_MOVE, MIN_TURN, SILENCE)


# --- a dead band

def test_frame_at_rest_goes_once_in_a_silence():
    band = dead_band()
    went = [sample.stamp for now in range(1, 36) for sample in band.offer([at(now)], now)]
    assert went == [1, 11, 21, 31]


def test_last_at_rest_goes_before_the_first_that_moved():
    band = dead_band()
    assert [band.offer([at(stamp, x)], stamp) for stamp, x in [
        (1, 0.0), (2, 0.001), (3, 0.0), (4, 0.5), (5, 1.0), (6, 1.0), (7, 0.0)]] == [
        [at(1)], [], [], [at(3), at(4, 0.5)], [at(5, 1.0)], [], [at(6, 1.0), at(7)]]


def test_slow_drift_goes_whenever_it_has_come_far_enough():
    band = DeadBand(MIN_MOVE, MIN_TURN, math.inf)
    went = [sample.stamp for stamp in range(13)
            for sample in band.offer([at(stamp, 0.003 * stamp)], 0)]
    assert went == [0, 3, 4, 7, 8, 11, 12]


def test_turn_alone_is_a_motion():
    band = dead_band()
    band.offer([at(1)], 1)
    turned = Sample('odom', 'base', 2, Pose.from_xyz_rpy(yaw=0.021))
    assert band.offer([turned], 2) == [turned]


def test_what_was_held_back_goes_when_its_publisher_falls_silent():
    band = dead_band()
    band.offer([at(1)], 1)
    band.offer([at(2)], 2)
    assert band.next_turn == 11
    assert band.due(10) == []
    assert band.due(11) == [at(2)]
    assert band.due(21) == []
    assert band.next_turn is None, 'a frame that is not heard costs nothing'
    assert band.offer([at(3)], 22) == [at(3)]


def test_new_parent_goes_and_the_last_under_the_old_one_before_it():
    band = dead_band()
    band.offer([at(1)], 1)
    band.offer([at(2)], 2)
    assert band.offer([at(3, parent='map')], 3) == [at(2), at(3, parent='map')]


def test_nothing_is_held_back_while_stamps_go_back():
    band = dead_band()
    band.offer([at(100)], 1)
    band.offer([at(101)], 2)
    assert band.offer([at(5)], 3) == [at(101), at(5)]
    assert band.offer([at(6)], 4) == [at(6)]
    assert band.offer([at(7)], 5) == []


def test_frames_are_judged_each_by_itself():
    band = dead_band()
    band.offer([at(1), at(1, child='arm')], 1)
    assert band.offer([at(2), at(2, 1.0, child='arm')], 2) == [at(2, 1.0, child='arm')]


# Steps between poses: within the thresholds, about as large, and any size.
small = st.floats(0.0, 1.2)
steps = st.lists(st.tuples(
    st.integers(1, 4), st.integers(0, 6), axes, axes,
    st.one_of(st.just((0.0, 0.0)), st.tuples(small, small), st.just((100.0, 150.0))),
), min_size=2, max_size=40)


def walk(start, steps):
    """Return samples with their arrival times, each a step from the previous one."""
    pose, stamp, now, samples = start, 0, 0, []
    for since, pause, way, axis, (far, much) in steps:
        stamp, now = stamp + since, now + pause
        turn = about(axis, much * MIN_TURN)
        place = [a + far * MIN_MOVE * b for a, b in zip(pose[:3], way, strict=True)]
        pose = (*place, *se3.compose((0.0, 0.0, 0.0, *turn), (0.0, 0.0, 0.0, *pose[3:]))[3:])
        samples.append((now, Sample('odom', 'base', stamp, pose)))
    return samples


@given(vectors, axes, st.floats(0.0, math.pi), steps)
@examples(10)
def test_thinned_samples_interpolate_within_twice_the_thresholds(
        place, axis, angle, steps):
    band, buffer, came = dead_band(), BufferCore(cache_time=UNLIMITED), []
    for now, sample in walk((*place, *about(axis, angle)), steps):
        came.append(sample)
        for went in (*band.due(now), *band.offer([sample], now)):
            assert not buffer.insert(*went)
        assert_within(1, buffer.lookup('odom', 'base'), sample)
    for went in band.due(now + SILENCE):
        buffer.insert(*went)
    for sample in came:
        assert_within(2, buffer.lookup('odom', 'base', sample.stamp), sample)


def assert_within(times, pose, sample):
    way, angle = se3.distance(tuple(pose), sample.pose)
    # Rounding: of coordinates up to a thousand kilometres, and of angles in quaternions.
    assert way <= times * MIN_MOVE + 1e-9, sample
    assert angle <= times * MIN_TURN + 1e-7, sample


# --- with rates

def feed(thinning, samples, period=SECOND // 100):
    """Offer samples one by one in real time; return the samples that were sent."""
    went = []
    for now, sample in enumerate(samples):
        went += [*thinning.due(now * period), *thinning.offer([sample], now * period)]
    while thinning.next_turn is not None:
        went += thinning.due(math.ceil(thinning.next_turn))
    return went


def test_without_limits_everything_goes():
    samples = [at(stamp) for stamp in range(100)]
    assert feed(Thinner(), samples) == samples
    assert Thinner().next_turn is None


def test_frames_have_rates_of_their_own():
    thinning, children = Thinner(rate_hz=10.0, rates={'arm': 2.0, 'odom': 0.0}), 'base arm odom'
    samples = [at(stamp, child=child) for stamp in range(100) for child in children.split()]
    went = feed(thinning, samples, SECOND // 300)
    assert [sum(sample.child == child for sample in went)
            for child in children.split()] == [11, 3, 100]
    assert {sample.child for sample in went if sample.stamp == 99} == set(children.split())


def test_rate_comes_first_and_a_rest_is_ended_by_a_sample_all_the_same():
    thinning = Thinner(rate_hz=10.0, min_move=MIN_MOVE, max_silence=5.0)
    went = feed(thinning, [at(stamp, max(0.0, stamp - 200.0)) for stamp in range(301)])
    assert [sample.stamp for sample in went] == [0, *range(199, 300, 10), 300]


@pytest.mark.parametrize(('limits', 'sentence'), [
    ({'rate_hz': -1.0}, 'rate_hz must be a finite number, zero or greater, not -1.0'),
    ({'rates': {'odom': math.nan}}, "the rate of 'odom' must be a finite number"),
    ({'min_move': math.inf}, 'min_move must be'),
    ({'min_turn': -0.1}, 'min_turn must be'),
    ({'max_silence': 0.0}, 'max_silence must be greater than zero'),
])
def test_limits_that_cannot_be_are_refused(limits, sentence):
    with pytest.raises(ValueError, match=sentence):
        Thinner(**limits)


# --- with a sender

@contextmanager
def sent(thinning):
    """Yield a sender of samples, and a function that returns the next message that it sent."""
    messages = SimpleQueue()
    moving = MovingSender(messages.put, thinning)
    yield moving, lambda: list(messages.get(timeout=PATIENCE_S))
    moving.close()


def test_frame_of_a_high_rate_does_not_wait_for_one_of_a_low_rate():
    with sent(Thinner(rates={'slow': 0.1, 'quick': 50.0})) as (moving, next_message):
        moving.offer([at(1, child='slow')])
        slow_turn = moving.next_turn
        moving.offer([at(1, child='quick')])
        end = time.monotonic() + PATIENCE_S
        while moving.next_turn != slow_turn:  # then the thread sleeps until that turn
            assert time.monotonic() < end
        for sample in (at(2, child='slow'), at(2, child='quick'), at(3, child='quick')):
            moving.offer([sample])
        assert [next_message() for _ in range(4)] == [
            [at(1, child='slow')], *([at(stamp, child='quick')] for stamp in (1, 2, 3))]


def test_last_pose_of_a_frame_that_is_heard_no_more_goes():
    with sent(Thinner(min_move=1.0, max_silence=0.05)) as (moving, next_message):
        moving.offer([at(1)])
        moving.offer([at(2)])
        assert [next_message(), next_message()] == [[at(1)], [at(2)]]
