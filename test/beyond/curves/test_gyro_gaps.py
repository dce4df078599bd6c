# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Gaps of a gyroscope between the poses are bridged from what it measured before and after."""

from contextlib import suppress

from inputs import for_each
import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, load
from tf_tree_py.core import Pose, se3, TransformException, UNLIMITED
from tf_tree_py.core.geometry import so3

SECOND = 1_000_000_000
MS = 1_000_000
POSES = range(0, SECOND + 1, 50 * MS)
EVERYWHERE = np.arange(0, SECOND - 1, 333_333)


def yaw_at(stamps):
    """Return the yaw that docs/prediction.md has as its example: fast, at 20 Hz."""
    return 0.5 * np.sin(30e-9 * np.asarray(stamps))


def swinging(gaps=(), saturation=np.inf, cache_time=UNLIMITED):
    """Return such an edge, with gaps of the gyroscope: pairs of milliseconds, begin and end."""
    buffer = BufferCore(cache_time=cache_time)
    for stamp in POSES:
        buffer.insert('odom', 'base', stamp, Pose.from_xyz_rpy(x=stamp / SECOND,
                                                               yaw=yaw_at(stamp)))
    buffer.aid('base', *measured(gaps, saturation), saturation=saturation)
    return buffer


def measured(gaps=(), saturation=np.inf):
    """Return the stamps of the gyroscope's samples, and its rates."""
    stamps = np.arange(0, SECOND + 1, MS)
    for begin, end in gaps:
        stamps = stamps[(stamps <= begin * MS) | (stamps >= end * MS)]
    rates = np.zeros((len(stamps), 3))
    rates[:, 2] = np.clip(15.0 * np.cos(30e-9 * stamps), -saturation, saturation)
    return stamps, rates


def errors(buffer, asked=EVERYWHERE):
    """Return the errors of the yaw at stamps."""
    poses = buffer.lookup_many('odom', 'base', asked)
    return np.abs(2.0 * np.arctan2(poses[:, 5], poses[:, 6]) - yaw_at(asked))


# --- how exact

@for_each(limit=[(10, 1e-4), (20, 2e-4), (30, 9e-4), (40, 3e-3), (60, 0.008), (90, 0.011)],
          begin=range(201, 260, 7))
def test_gap_is_bridged_wherever_it_is(limit, begin):
    """The largest error is about g^4 w''' / 384; without a gyroscope it is 0.13 rad."""
    length, most = limit
    off = errors(swinging([(begin, begin + length)]))
    assert off.max() < most
    milliseconds = EVERYWHERE / MS
    assert off[(milliseconds < begin) | (milliseconds > begin + length)].max() < 1e-4


def test_without_the_gyroscope_it_is_far_off():
    buffer = BufferCore()
    for stamp in POSES:
        buffer.insert('odom', 'base', stamp, Pose.from_xyz_rpy(yaw=yaw_at(stamp)))
    assert errors(buffer).max() > 0.13 and errors(swinging()).max() < 1e-4


@for_each(limit=[(14.0, 1e-4), (12.0, 3e-4), (10.0, 1e-3)])
def test_saturation_is_bridged(limit):
    saturation, most = limit
    assert errors(swinging(saturation=saturation)).max() < most


def tumbling(stamps):
    """Return poses (N, 7) that turn fast about all axes."""
    t = 1e-9 * np.asarray(stamps)[:, None]
    first = np.concatenate([0.3 * np.sin(25.0 * t), 0.4 * np.cos(19.0 * t), 0 * t], axis=1)
    second = np.concatenate([0 * t, 0.2 * np.sin(31.0 * t), 3.0 * t], axis=1)
    return np.concatenate([np.zeros((len(t), 3)), so3.multiply_many(
        so3.exp_many(first), so3.exp_many(second))], axis=1)


STEP = 20_000


def tumbling_rates(stamps):
    """Return the angular velocities of these poses, (N, 3)."""
    before, after = tumbling(np.asarray(stamps) - STEP), tumbling(np.asarray(stamps) + STEP)
    return so3.log_many(so3.multiply_many(
        so3.conjugate_many(before[:, 3:]), after[:, 3:])) / (2e-9 * STEP)


@for_each(gaps=[(), [(310, 340)], [(290, 320)], [(310, 316), (330, 345)], [(280, 365)],
                [(290, 310), (320, 340), (345, 370)]])
def test_rotation_about_changing_axes_is_bridged(gaps):
    """Also with two gaps between the same poses, and with a pose or two in the gap."""
    buffer = BufferCore(cache_time=UNLIMITED)
    for stamp, pose in zip(POSES, tumbling(POSES), strict=True):
        buffer.insert('odom', 'base', stamp, Pose(*pose))
    buffer.aid('base', measured(gaps)[0], tumbling_rates(measured(gaps)[0]))
    _, angles = se3.distance_many(
        buffer.lookup_many('odom', 'base', EVERYWHERE), tumbling(EVERYWHERE))
    assert angles.max() < (0.012 if gaps == [(280, 365)] else 0.003 if gaps else 5e-4)
    # Also the rates agree at the ends of a gap.
    for stamp in (one * MS for gap in gaps for one in gap):
        for begin, end in ((stamp - STEP, stamp), (stamp, stamp + STEP)):
            turn = se3.compose(se3.inverse(buffer.lookup_at('odom', 'base', begin)),
                               buffer.lookup_at('odom', 'base', end))
            rate = np.array(so3.log(turn[3:])) / (1e-9 * STEP)
            assert np.linalg.norm(rate - tumbling_rates([stamp])[0]) < 0.15


def test_bridge_agrees_with_the_poses_and_has_no_jump():
    """It ends where the measured parts begin, and at each pose."""
    buffer = swinging([(212, 231), (285, 330)])
    plain = BufferCore(cache_time=UNLIMITED)
    for stamp in POSES:
        plain.insert('odom', 'base', stamp, buffer.lookup_at('odom', 'base', stamp))
        assert buffer.lookup_at('odom', 'base', stamp).as_rpy()[2] == pytest.approx(
            yaw_at(stamp))
    for stamp in (212, 231, 250, 285, 300, 330, 350):
        before, at, after = (buffer.lookup_at('odom', 'base', stamp * MS + one)
                             for one in (-1, 0, 1))
        # At 15 rad/s it turns by 15e-9 rad in a nanosecond.
        assert se3.distance(before, at)[1] < 1e-7 and se3.distance(at, after)[1] < 1e-7


@for_each(gaps=[[(212, 231)], [(285, 330)], [(205, 209), (220, 240)], [(100, 900)],
                [(185, 215), (230, 270), (285, 340)], [(205, 225), (235, 400)]])
def test_many_stamps_are_one_by_one_in_gaps(gaps):
    buffer = swinging(gaps)
    poses = buffer.lookup_many('odom', 'base', EVERYWHERE)
    for number in range(0, len(EVERYWHERE), 7):
        assert_same_pose(poses[number], buffer.lookup_at('odom', 'base', int(EVERYWHERE[number])),
                         tolerance=1e-9)


def slowly(stamps):
    """Return the yaw of an edge whose poses arrive at 2 Hz."""
    return 0.5 * np.sin(6e-9 * np.asarray(stamps))


def with_rare_poses(gaps):
    """Return such an edge, with gaps of the gyroscope: pairs of milliseconds, begin and end."""
    buffer = BufferCore(cache_time=UNLIMITED)
    for stamp in range(0, 3 * SECOND + 1, 500 * MS):
        buffer.insert('odom', 'base', stamp, Pose.from_xyz_rpy(yaw=slowly(stamp)))
    stamps = np.arange(0, 3 * SECOND + 1, 5 * MS)
    for begin, end in gaps:
        stamps = stamps[(stamps <= begin * MS) | (stamps >= end * MS)]
    rates = np.zeros((len(stamps), 3))
    rates[:, 2] = 3.0 * np.cos(6e-9 * stamps)
    buffer.aid('base', stamps, rates, max_gap=12 * MS)
    return buffer


def slow_errors(buffer):
    """Return the stamps at which errors of the yaw are measured, milliseconds, and these."""
    asked = np.arange(0, 3 * SECOND - 1, 1_333_333)
    poses = buffer.lookup_many('odom', 'base', asked)
    return asked / MS, np.abs(2.0 * np.arctan2(poses[:, 5], poses[:, 6]) - slowly(asked))


@for_each(gaps=[
    [(1100, 1140), (1300, 1340)], [(1060, 1080), (1200, 1260), (1420, 1440)],
    [(1480, 1520), (1300, 1340), (980, 1020)], [(1010, 1050), (1465, 1540)]])
def test_each_gap_between_two_poses_is_bridged(gaps):
    """What was measured between the gaps is used, however far they are apart."""
    assert slow_errors(with_rare_poses(gaps))[1].max() < 2e-3
    assert slow_errors(with_rare_poses([(-1, 5000)]))[1].max() > 0.4


@for_each(gaps=[[(1250, 1290), (1060, 1180), (1400, 1440)], [(1060, 1180), (1300, 1440)]])
def test_measurement_beside_a_long_gap_is_used(gaps):
    """Two long gaps between the same poses are one, since only the sum of their turns is known."""
    long = [gap for gap in gaps if gap[1] - gap[0] > 100]
    begin, end = min(long)[0], max(long)[1]
    stamps, off = slow_errors(with_rare_poses(gaps))
    outside = (stamps < begin) | (stamps > end)
    assert off[outside].max() < 1e-3 < 0.01 < off[~outside].max()
    _, joined = slow_errors(with_rare_poses([(begin, end)]))
    np.testing.assert_allclose(off[~outside], joined[~outside], atol=1e-3)


def test_bias_is_spread_over_all_gaps_between_two_poses():
    """In proportion to the cubes of their lengths: 8 to 1."""
    buffer, bias = BufferCore(cache_time=UNLIMITED), 0.02
    for stamp in (0, SECOND):
        buffer.insert('odom', 'base', stamp, Pose())
    stamps = np.arange(0, 1001, 5)
    stamps = stamps[((stamps <= 200) | (stamps >= 280)) & ((stamps <= 600) | (stamps >= 640))]
    buffer.aid('base', stamps * MS, np.tile((0.0, 0.0, bias), (len(stamps), 1)))
    yaws = [buffer.lookup_at('odom', 'base', stamp * MS).as_rpy()[2]
            for stamp in (100, 200, 280, 400, 600, 640, 800)]
    left = 8.0 / 9.0 * bias
    assert yaws == pytest.approx([0.1 * bias, 0.2 * bias, 0.28 * bias - left, 0.4 * bias - left,
                                  0.6 * bias - left, -0.36 * bias, -0.2 * bias])


# --- what is not bridged

def test_long_gap_is_crossed_as_without_a_gyroscope():
    """From 0.21 s to 0.63 s; what was measured before and after is used."""
    buffer, plain = swinging([(210, 630)]), swinging([(-1, 2000)])
    for stamp in range(250 * MS, 600 * MS, 7 * MS):
        assert_same_pose(buffer.lookup_at('odom', 'base', stamp),
                         plain.lookup_at('odom', 'base', stamp), tolerance=1e-12)
    assert errors(buffer, np.array([205 * MS, 635 * MS, 645 * MS])).max() < 1e-4
    # The rest of these two intervals bends to the next pose.
    inside = np.concatenate([np.arange(211, 250, 3), np.arange(601, 630, 3)]) * MS
    assert errors(buffer, inside).max() < 0.5 * errors(plain, inside).max()


def test_gap_between_distant_poses_is_crossed_evenly_if_it_is_long():
    """Poses each second, a gap of 0.4 s: before and after it is as measured."""
    buffer = BufferCore(cache_time=UNLIMITED)
    for second in range(3):
        buffer.insert('odom', 'base', second * SECOND, Pose.from_xyz_rpy(yaw=float(second)))
    stamps = np.concatenate([np.arange(0, 1301, 10), np.arange(1700, 2001, 10)]) * MS
    rates = np.zeros((len(stamps), 3))
    # It turns fast at first, by 0.6 rad, and then slowly, by 0.1 rad.
    rates[:, 2] = np.where(stamps < SECOND, 1.0, np.where(stamps < 1500 * MS, 2.0, 1.0 / 3.0))
    buffer.aid('base', stamps, rates)
    yaws = [buffer.lookup_at('odom', 'base', stamp * MS).as_rpy()[2]
            for stamp in (1150, 1300, 1400, 1500, 1700, 1850)]
    assert yaws == pytest.approx([1.3, 1.6, 1.675, 1.75, 1.9, 1.95], abs=0.01)


def test_gyroscope_that_begins_or_ends_between_two_poses_is_used():
    buffer, plain = swinging([(-1, 220), (770, 2000)]), swinging([(-1, 2000)])
    for begin, end in ((200, 220), (770, 800)):
        asked = np.arange(begin * MS, end * MS, MS)
        assert errors(buffer, asked).max() < 0.5 * errors(plain, asked).max()
    assert errors(buffer, np.arange(221 * MS, 770 * MS, MS)).max() < 1e-4
    outside = 190 * MS
    assert buffer.lookup_at('odom', 'base', outside) == plain.lookup_at('odom', 'base', outside)


def test_gap_is_not_bridged_over_another_parent():
    """The gap contains the last pose below odom."""
    buffer, earlier = BufferCore(cache_time=UNLIMITED), BufferCore(cache_time=UNLIMITED)
    for stamp in POSES:
        pose = Pose.from_xyz_rpy(yaw=yaw_at(stamp))
        buffer.insert('odom' if stamp < 350 * MS else 'map', 'base', stamp, pose, strict=False)
        if stamp < 350 * MS:
            earlier.insert('odom', 'base', stamp, pose)
    for each in (buffer, earlier):
        each.aid('base', *measured([(285, 330)]))
    assert buffer.lookup_at('odom', 'base', 290 * MS) == earlier.lookup_at(
        'odom', 'base', 290 * MS)


def test_pose_with_two_samples_in_a_gap_counts_once():
    buffer = swinging([(285, 330)])
    expected = buffer.lookup_at('odom', 'base', 310 * MS)
    buffer.insert('odom', 'base', 300 * MS, buffer.lookup_at('odom', 'base', 300 * MS))
    assert_same_pose(buffer.lookup_at('odom', 'base', 310 * MS), expected, tolerance=1e-12)


# --- in any order, and in every copy

@for_each(gaps=[[(212, 231)], [(285, 330)], [(285, 365)], [(205, 209), (220, 240)],
                [(185, 215), (230, 270), (285, 340)]], seed=[1, 2])
def test_order_of_arrival_does_not_matter_for_a_gap(gaps, seed):
    """After each arrival there are lookups."""
    expected, buffer = swinging(gaps), BufferCore(cache_time=UNLIMITED)
    stamps, rates = measured(gaps)
    rng, asked = np.random.default_rng(seed), (222 * MS, 290 * MS, 310 * MS, 340 * MS)
    # The gyroscope's samples arrive in order, in pieces, and the poses at any time.
    pieces = [('rates', piece) for piece in np.array_split(np.arange(len(stamps)), 40)]
    events = [('pose', stamp) for stamp in rng.permutation(POSES).tolist()]
    for piece in pieces:
        events.insert(int(rng.integers(0, len(events) + 1)), piece)
    order = iter(pieces)
    for kind, what in events:
        if kind == 'pose':
            buffer.insert('odom', 'base', what, expected.lookup_at('odom', 'base', what))
        else:
            _, piece = next(order)
            buffer.aid('base', stamps[piece], rates[piece])
        for stamp in asked:
            with suppress(TransformException):
                buffer.lookup('odom', 'base', stamp)
    for stamp in asked:
        assert_same_pose(buffer.lookup('odom', 'base', stamp),
                         expected.lookup('odom', 'base', stamp), tolerance=1e-12)
    np.testing.assert_allclose(buffer.lookup_many('odom', 'base', asked),
                               expected.lookup_many('odom', 'base', asked), atol=1e-9)


def test_copies_bridge_the_same_gaps(tmp_path):
    buffer = swinging([(212, 231), (285, 330)])
    buffer.save(tmp_path / 'tree')
    for tree in (buffer.snapshot(), load(tmp_path / 'tree')):
        for stamp in (205 * MS, 220 * MS, 290 * MS, 310 * MS):
            assert tree.lookup_at('odom', 'base', stamp) == buffer.lookup_at(
                'odom', 'base', stamp)
        np.testing.assert_array_equal(tree.lookup_many('odom', 'base', EVERYWHERE),
                                      buffer.lookup_many('odom', 'base', EVERYWHERE))


def test_next_pose_changes_a_bridge_that_was_looked_up():
    """The gyroscope has bridged the gap already, but the pose after it is not there yet."""
    expected, buffer = swinging([(285, 330)]), BufferCore(cache_time=UNLIMITED)
    buffer.aid('base', *measured([(285, 330)]))
    for stamp in POSES:
        buffer.insert('odom', 'base', stamp, expected.lookup_at('odom', 'base', stamp))
        if stamp >= 300 * MS:
            buffer.lookup_at('odom', 'base', 290 * MS)
    assert_same_pose(buffer.lookup_at('odom', 'base', 290 * MS),
                     expected.lookup_at('odom', 'base', 290 * MS), tolerance=1e-12)


def test_late_pose_in_a_gap_changes_the_bridge():
    late = 310 * MS
    buffer, fresh = swinging([(285, 330)]), swinging([(285, 330)])
    before = buffer.lookup_at('odom', 'base', 305 * MS)
    for each in (buffer, fresh):
        each.insert('odom', 'base', late, Pose.from_xyz_rpy(yaw=yaw_at(late)))
    found = buffer.lookup_at('odom', 'base', 305 * MS)
    assert found == fresh.lookup_at('odom', 'base', 305 * MS) != before


def test_expired_gyroscope_bridges_nothing():
    """Its window ends at its own newest sample."""
    buffer = swinging([(212, 231)], cache_time=SECOND)
    turned = buffer.lookup_at('odom', 'base', 220 * MS)
    more = np.arange(SECOND + MS, SECOND + 400 * MS, MS)
    buffer.aid('base', more, np.zeros((len(more), 3)))
    plain = swinging([(-1, 2000)])
    assert buffer.lookup_at('odom', 'base', 220 * MS) == plain.lookup_at(
        'odom', 'base', 220 * MS) != turned
