# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What predictions learnt depends on the samples, also if these arrive late."""

from contextlib import suppress

from inputs import for_each
import numpy as np
import pytest
from tf_tree_py import BufferCore, screws
from tf_tree_py.core import Interpolation, Linear, Pose, TransformException
from turning_robot import aided, MS, SECOND, turning


# An earlier prediction, by exactly 65.536 ms, ends at the newest sample.
@for_each(step=[16_384_000, 400 * MS, 1100 * MS], many=[False, True])
def test_late_samples_change_what_was_learnt(step, many):
    """Samples arrive late and twice; a snapshot has never predicted."""
    rng, buffer, late = np.random.default_rng(1), BufferCore(cache_time=20 * SECOND), []

    def insert(stamp, pose):
        buffer.insert('odom', 'base', stamp, pose)
        asked = ('odom', 'base', buffer.latest_common_time('odom', 'base') + 65_536_000, SECOND)
        found = buffer.predict(*asked) if stamp > SECOND else None
        is_late = stamp < buffer.latest_common_time('odom', 'base')
        if found is not None and (is_late or rng.random() < 0.1):
            np.testing.assert_allclose(found.covariance, buffer.snapshot().predict(
                *asked).covariance, rtol=1e-9, atol=1e-18)

    for stamp in range(0, 400 * step, step):
        pose = Pose.from_xyz_rpy(x=np.sin(stamp / SECOND)**3, yaw=rng.normal(scale=0.01))
        if stamp and rng.random() < 0.05:
            late.append((stamp, pose))
            continue
        insert(stamp, pose)
        if rng.random() < 0.3:
            insert(stamp, Pose(x=pose.x + 1.0))
        if late and rng.random() < 0.1:
            if many:
                stamps, poses = zip(*late, strict=True)
                buffer.insert_track('odom', 'base', list(stamps), list(poses))
            else:
                for each in late:
                    insert(*each)
            late = []


def work(buffer, asked):
    """Return how many predictions of the past are compared."""
    compared, exp_many = [], screws.exp_many

    def noted(twists):
        compared.append(len(twists))
        return exp_many(twists)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(screws, 'exp_many', noted)
        buffer.predict(*asked)
    return sum(compared)


@for_each(lateness=[50 * MS, 5 * SECOND])
def test_late_sample_costs_no_more_than_it_changes(lateness):
    """What was learnt from before the sample is kept."""
    buffer, newest = BufferCore(cache_time=100 * SECOND), 60 * SECOND
    for stamp in range(0, newest + 1, 10 * MS):
        buffer.insert('odom', 'base', stamp, turning(stamp / SECOND))
    asked = 'odom', 'base', newest + 100 * MS, SECOND
    first = work(buffer, asked)
    late = newest - lateness + 5 * MS
    buffer.insert('odom', 'base', late, turning(late / SECOND))
    again = work(buffer, asked)
    # For each of two rungs, 16 in each cell.
    assert first > 900 and again <= (4 * 16 if lateness < SECOND else 0.6 * first)
    assert work(buffer, asked) == 0


def test_late_sample_with_another_parent_ends_what_counts():
    """Below map it brakes hard until 4 s; a late sample says that it was below odom at 5 s."""
    buffer = BufferCore(cache_time=100 * SECOND)
    for stamp in range(0, 9 * SECOND + 1, 20 * MS):
        parent = 'odom' if stamp < 2 * SECOND else 'map'
        x = 4.0 * min(stamp / SECOND, 4.0) - 0.5 * min(stamp / SECOND, 4.0)**2
        buffer.insert(parent, 'base', stamp, Pose(x=x), strict=False)
    asked = 'map', 'base', 9200 * MS, SECOND
    before = buffer.predict(*asked).covariance
    buffer.insert('odom', 'base', 5 * SECOND + 1, Pose(), strict=False)
    after = buffer.predict(*asked).covariance
    np.testing.assert_allclose(after, buffer.snapshot().predict(*asked).covariance)
    assert after[0, 0] < 0.5 * before[0, 0]


# --- beside a gyroscope

@for_each(lead=[-100 * MS, 10 * MS], gaps=[
    [], [(5955, 6055)], [(5955, 6055), (6075, 6160)], [(5955, 6055), (6080, 6155)]])
def test_late_gyroscope_changes_what_was_learnt(lead, gaps):
    """It arrives later than the poses, or has gaps, which are bridged after the next poses."""
    buffer, newest = aided(4900 * MS, 5 * SECOND), 4900 * MS
    for stamp in range(5050 * MS, 7 * SECOND, 50 * MS):
        buffer.insert('odom', 'base', stamp, turning(stamp / SECOND))
        aheads = 120 * MS, 330 * MS
        for ahead in aheads:
            buffer.predict('odom', 'base', stamp + ahead, SECOND)
        stamps = np.arange(newest + 5 * MS, stamp + lead + 1, 5 * MS)
        newest = stamps[-1]
        for begin, end in gaps:
            stamps = stamps[(stamps <= begin * MS) | (stamps >= end * MS)]
        buffer.aid('base', stamps, [(0.0, 0.0, np.cos(2e-9 * one)) for one in stamps])
        for ahead in aheads:
            asked = 'odom', 'base', stamp + ahead, SECOND
            np.testing.assert_allclose(
                buffer.predict(*asked).covariance, buffer.snapshot().predict(*asked).covariance,
                rtol=1e-9, atol=1e-18)


@for_each(seed=range(4), cache_time=[4 * SECOND, 100 * SECOND])
def test_late_poses_beside_a_gyroscope_change_what_was_learnt(seed, cache_time):
    """They change the rotation in gaps before them; and what has expired has no effect."""
    rng, buffer, late = np.random.default_rng(seed), BufferCore(cache_time=cache_time), []
    measured, period = 0, (50 * MS, 333 * MS)[seed % 2]
    for stamp in range(0, 100 * period, period):
        pose = Pose.from_xyz_rpy(yaw=0.4 * np.sin(4e-9 * stamp) + rng.normal(scale=0.001))
        if stamp and rng.random() < 0.15:
            late.append((stamp, pose))
            continue
        buffer.insert('odom', 'base', stamp, pose)
        stamps = np.arange(measured + 5 * MS, stamp + int(rng.choice([-80, 10, 40])) * MS, 5 * MS)
        measured = max([measured, *stamps.tolist()])
        if len(stamps) > 20:
            begin = rng.integers(1, len(stamps) - 19)
            stamps = np.delete(stamps, slice(begin, begin + rng.integers(2, 19)))
        buffer.aid('base', stamps, [(0.0, 0.0, 1.6 * np.cos(4e-9 * one)) for one in stamps],
                   max_gap=7 * MS)
        if changed := rng.random() < 0.2:
            for each in late:
                buffer.insert('odom', 'base', *each)
            late = []
        # What was learnt wrongly stays so, for as long as its samples do.
        if stamp > SECOND and (changed or stamp % (3 * period) == 0):
            asked = 'odom', 'base', stamp + 65_536_000, SECOND
            np.testing.assert_allclose(
                buffer.predict(*asked).covariance, buffer.snapshot().predict(*asked).covariance,
                rtol=1e-8, atol=1e-16)


def test_late_pose_in_a_gap_changes_an_error_before_the_pose_before_it():
    """The error of 1.85 s + 93 ms, in a gap from 1.935 s to 2.02 s; the pose of 2 s is late."""
    buffer, ahead = BufferCore(), 92_681_900
    # The error is that of the cell until 1.875 s, which has one sample.
    for stamp in sorted({1970 * MS, *range(0, 3 * SECOND + 1, 50 * MS)} - {
            1750 * MS, 1800 * MS, 2000 * MS}):
        buffer.insert('odom', 'base', stamp, turning(stamp / SECOND))
    stamps = np.arange(0, 3 * SECOND + 1, 5 * MS)
    stamps = stamps[(stamps <= 1935 * MS) | (stamps >= 2020 * MS)]
    buffer.aid('base', stamps, [(0.0, 0.0, np.cos(2e-9 * one)) for one in stamps], max_gap=7 * MS)
    asked = 'odom', 'base', 3 * SECOND + ahead, SECOND
    before = buffer.predict(*asked).covariance[5, 5]
    buffer.insert('odom', 'base', 2000 * MS, Pose.from_xyz_rpy(yaw=-0.2))
    expected = buffer.snapshot().predict(*asked).covariance[5, 5]
    assert buffer.predict(*asked).covariance[5, 5] == pytest.approx(expected, rel=1e-9)
    assert before != pytest.approx(expected, rel=1e-6)


@for_each(seed=range(4), period=[20 * MS, 100 * MS])
def test_ugly_samples_do_not_change_what_was_learnt(seed, period):
    """Gaps, late samples and equal stamps, in a buffer that keeps more than what counts."""
    rng, buffer, stamp = np.random.default_rng(seed), BufferCore(cache_time=40 * SECOND), 0
    for number in range(300):
        stamp += int(period * rng.choice([0, 0.01, 1, 1, 1, 1, 5]))
        late = int(period * rng.integers(0, 6)) if rng.random() < 0.08 else 0
        buffer.insert('odom', 'base', stamp - late, Pose.from_xyz_rpy(
            x=rng.normal(scale=0.01), yaw=0.3 * np.sin(stamp / SECOND)))
        if number > 20 and rng.random() < 0.2:
            for ahead in (0, period // 7, 3 * period):
                asked = 'odom', 'base', stamp + ahead, 9 * SECOND
                fresh = buffer.snapshot().predict(*asked).covariance
                np.testing.assert_allclose(
                    buffer.predict(*asked).covariance, fresh, rtol=1e-8, atol=1e-18)


def test_late_sample_in_a_gap_lets_a_prediction_be_compared():
    """Nothing followed the sample of 5.3 s, the only one of its cell, within 0.1 s."""
    rng, buffer, late = np.random.default_rng(1), BufferCore(), 5360 * MS
    for stamp in range(0, 12 * SECOND + 1, 20 * MS):
        if stamp == 5300 * MS or not 4980 * MS < stamp < 5700 * MS:
            buffer.insert('odom', 'base', stamp, Pose(x=rng.normal(scale=0.01)))
    asked = 'odom', 'base', 12 * SECOND + 100 * MS, SECOND
    before = buffer.predict(*asked).covariance[0, 0]
    buffer.insert('odom', 'base', late, Pose(x=1.0))
    after = buffer.predict(*asked).covariance[0, 0]
    assert after != pytest.approx(before, rel=0.01)
    assert after == pytest.approx(buffer.snapshot().predict(*asked).covariance[0, 0], rel=1e-9)


class Held(Interpolation):
    """Keeps each sample until the next."""

    def between(self, samples, index, stamp):
        return samples.pose(index)


def change(buffer, rng, now):
    """Change the past of the edge in one of many ways."""
    pick, moved = rng.integers(12), Pose(x=rng.normal())
    if pick == 0:
        buffer.insert('odom', 'base', now, moved)
    elif pick == 1:
        buffer.insert('odom', 'base', now - int(rng.integers(1, 900)) * MS, moved)
    elif pick == 2:
        buffer.set_interpolation('base', Held() if rng.random() < 0.5 else Linear())
    elif pick == 3:
        stamps = np.arange(max(now - int(rng.integers(1, 3)) * SECOND, 0), now, 5 * MS)
        buffer.aid('base', stamps, rng.normal(size=(len(stamps), 3)))
    elif pick == 4:
        buffer.correct('base', moved, over=int(rng.integers(1, 100)) * MS)
    elif pick == 5 and rng.random() < 0.2:
        buffer.insert('map', 'base', now + 1, moved)


@pytest.mark.parametrize('seed', range(8))
def test_whatever_changes_the_past_changes_what_was_learnt(seed):
    """A snapshot has learnt nothing yet."""
    rng, buffer, now, compared = np.random.default_rng(seed), BufferCore(), 0, 0
    buffer.insert('map', 'odom', 0, Pose(), static=True)
    for _ in range(200):
        now += int(rng.integers(2, 40)) * MS
        buffer.insert('odom', 'base', now, Pose.from_xyz_rpy(
            x=1e-9 * now + rng.normal(scale=0.01), yaw=rng.normal(scale=0.01)))
        with suppress(TransformException):  # such as a sample that is too old
            change(buffer, rng, now)
        if rng.random() < 0.3:
            asked = 'map', 'base', now + int(rng.integers(2, 300)) * MS, SECOND
            try:
                found = buffer.predict(*asked)
            except TransformException:  # one sample with this parent
                continue
            fresh = buffer.snapshot().predict(*asked)
            np.testing.assert_allclose(found.pose, fresh.pose, atol=1e-9)
            np.testing.assert_allclose(found.covariance, fresh.covariance, rtol=1e-6, atol=1e-12)
            compared += 1
    assert compared > 30
