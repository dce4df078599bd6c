# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A gyroscope between the poses: its effect, and the properties that it must not change."""

import numpy as np
import pytest
from strategies import angle_between, assert_same_pose
from tf_tree_py import BufferCore
from tf_tree_py.beyond.curves.aided import gyro_of
from tf_tree_py.core import InvalidArgumentException, Pose, se3
from tf_tree_py.core.geometry import so3

SECOND = 1_000_000_000
STAMPS = np.arange(0, 2 * SECOND + 1, 1_000_000)
POSES = STAMPS[::50]  # 20 Hz


def rate_at(stamps):
    """Return angular velocities that oscillate fast about all axes, radians a second."""
    t = np.asarray(stamps)[..., None] / SECOND
    return np.concatenate([12.0 * np.cos(40.0 * t), 9.0 * np.sin(31.0 * t),
                           3.0 + 5.0 * np.cos(25.0 * t)], axis=-1)


def true_rotations():
    """Return the rotations at STAMPS, integrated in steps of 20 us."""
    fine = np.arange(0, 2 * SECOND, 20_000)
    steps = so3.exp_many(rate_at(fine + 10_000) * 20e-6)
    q, rotations = so3.IDENTITY, [so3.IDENTITY]
    for number, step in enumerate(map(tuple, steps.tolist()), start=1):
        q = so3.multiply(q, step)
        if number % 50 == 0:
            rotations.append(so3.normalize(q))
    return np.array(rotations)


@pytest.fixture(scope='module')
def truth():
    return true_rotations()


def fed(truth):
    buffer = BufferCore(cache_time=100 * SECOND)
    buffer.insert('base', 'camera', 0, Pose(z=1.0), static=True)
    for stamp in POSES.tolist():
        buffer.insert('odom', 'base', stamp,
                      Pose.from_parts((stamp / SECOND, 0.0, 0.0), truth[stamp // 1_000_000]))
    return buffer


def worst_error(buffer, truth, stamps=STAMPS[:-50]):
    poses = buffer.lookup_many('odom', 'base', stamps)
    _, angles = se3.distance_many(poses, np.concatenate(
        [np.zeros((len(stamps), 3)), truth[stamps // 1_000_000]], axis=1))
    return float(angles.max())


def test_fast_rotation_between_poses_is_what_the_gyroscope_saw(truth):
    buffer = fed(truth)
    assert worst_error(buffer, truth) > 0.15
    assert buffer.aid('base', STAMPS, rate_at(STAMPS)) == len(STAMPS)
    assert worst_error(buffer, truth) < 0.001


def test_bias_is_spread_and_the_poses_stay(truth):
    buffer = fed(truth)
    before = [buffer.lookup_at('odom', 'base', stamp) for stamp in POSES.tolist()]
    buffer.aid('base', STAMPS, rate_at(STAMPS) + (0.05, -0.03, 0.02))
    assert worst_error(buffer, truth) < 0.002
    for stamp, pose in zip(POSES.tolist(), before, strict=True):
        assert buffer.lookup_at('odom', 'base', stamp) == pose
    # The correction ends at the next pose, approached from below.
    just_before = buffer.lookup_at('odom', 'base', int(POSES[5]) - 1)
    assert angle_between(just_before[3:], before[5][3:]) < 1e-7


def test_translation_goes_straight_as_before(truth):
    buffer = fed(truth)
    buffer.aid('base', STAMPS, rate_at(STAMPS))
    assert buffer.lookup('odom', 'base', 1_234_567_890).x == pytest.approx(1.23456789)


@pytest.mark.parametrize('ends', [('odom', 'camera'), ('camera', 'odom'), ('odom', 'base')])
def test_many_stamps_are_one_by_one(truth, ends):
    buffer = fed(truth)
    buffer.aid('base', STAMPS[300:1500], rate_at(STAMPS[300:1500]))
    stamps = np.random.default_rng(1).integers(0, 2 * SECOND, 300)
    for stamp, pose in zip(stamps.tolist(), buffer.lookup_many(*ends, stamps), strict=True):
        assert_same_pose(pose, buffer.lookup_at(*ends, stamp), tolerance=1e-7)
    many = np.sort(np.random.default_rng(2).integers(0, 2 * SECOND, 30_000))
    poses = buffer.lookup_many(*ends, many)
    for number in range(0, 30_000, 999):
        assert_same_pose(poses[number], buffer.lookup_at(*ends, int(many[number])), 1e-7)


def test_where_the_gyroscope_measured_nothing_poses_are_interpolated_as_before(truth):
    """It measured from 150 ms to 299 ms, so also most of the last interval before 300 ms."""
    plain, buffer = fed(truth), fed(truth)
    some = STAMPS[np.arange(150, 300)]
    buffer.aid('base', some, rate_at(some))
    for inside in (POSES[3], POSES[4], POSES[5]):
        stamp = int(inside) + 7_000_000
        assert buffer.lookup('odom', 'base', stamp) != plain.lookup('odom', 'base', stamp)
    for outside in (POSES[0], POSES[2], POSES[6], POSES[20]):
        stamp = int(outside) + 7_000_000
        assert buffer.lookup('odom', 'base', stamp) == plain.lookup('odom', 'base', stamp)


def test_order_of_arrival_does_not_matter(truth):
    first, then = fed(truth), BufferCore(cache_time=100 * SECOND)
    first.aid('base', STAMPS, rate_at(STAMPS))
    for begin in range(0, len(STAMPS), 100):
        part = STAMPS[begin:begin + 100]
        assert then.aid('/base', part[::-1], rate_at(part[::-1])) == len(part)
    assert then.aid('base', STAMPS[:5], rate_at(STAMPS[:5])) == 0
    assert then.frames() == [] and then.edges() == []
    for stamp in POSES.tolist():
        then.insert('odom', 'base', stamp, first.lookup_at('odom', 'base', stamp))
    stamp = 777_777_777
    assert_same_pose(then.lookup('odom', 'base', stamp), first.lookup('odom', 'base', stamp),
                     tolerance=1e-12)


def test_snapshot_has_it_and_clearing_forgets_it(truth):
    buffer = fed(truth)
    buffer.lookup('odom', 'camera', SECOND)
    buffer.aid('base', STAMPS, rate_at(STAMPS))
    still, aided = buffer.snapshot(), buffer.lookup('odom', 'camera', 777_777_777)
    buffer.clear()
    for stamp in POSES.tolist():
        buffer.insert('odom', 'base', stamp, still.lookup_at('odom', 'base', stamp))
    assert still.lookup('odom', 'camera', 777_777_777) == aided
    assert buffer.lookup('odom', 'camera', 777_777_777) != aided


def test_it_is_forgotten_with_the_window():
    buffer = BufferCore(cache_time=SECOND)
    for begin in range(20):
        stamps = begin * SECOND + np.arange(0, SECOND, 1_000_000)
        buffer.aid('base', stamps, np.zeros((1000, 3)))
    assert len(gyro_of(buffer.intake.tree.histories['base']).orientations) <= 1002


def test_wrong_arguments_are_told():
    buffer = BufferCore()
    buffer.insert('base', 'camera', 0, Pose(), static=True)
    for arguments, sentence in (
            (('camera', [1], [(0.0, 0.0, 0.0)]), 'base -> camera is static: a gyroscope cannot'),
            (('base', [1, 2], [(0.0, 0.0, 0.0)]), r'one for each of 2 stamps, not \(1, 3\)'),
            (('base', [1], [(0.0, np.nan, 0.0)]), 'not finite'),
            (('base', [1], 'fast'), r'are \(N, 3\) numbers'),
            (('base', [0.1], [(0.0, 0.0, 0.0)]), 'integer nanoseconds'),
            ((7, [1], [(0.0, 0.0, 0.0)]), 'name of a frame')):
        with pytest.raises(InvalidArgumentException, match=sentence):
            buffer.aid(*arguments)
    assert buffer.aid('base', [], []) == 0


def late_pose(buffer, stamp):
    buffer.insert('odom', 'base', stamp, Pose(x=5.0, y=1.0))


def late_poses(buffer, stamp):
    buffer.insert_track('odom', 'base', [stamp], [Pose(x=5.0, y=1.0)])


def another_run(buffer, _):
    buffer.clear()
    for stamp in POSES.tolist():
        buffer.insert('odom', 'base', stamp, Pose(x=stamp / SECOND, y=2.0))


@pytest.mark.parametrize('change', [late_pose, late_poses, another_run])
def test_what_is_kept_of_the_last_lookup_follows_the_poses(truth, change):
    """The late pose has the stamp of a pose at the start of an interval that was looked up."""
    stamp = int(POSES[10])
    asked = 'odom', 'base', stamp + 7_000_000
    buffer, fresh = fed(truth), fed(truth)
    for each in (buffer, fresh):
        each.aid('base', STAMPS, rate_at(STAMPS))
    before = buffer.lookup(*asked)
    for each in (buffer, fresh):
        change(each, stamp)
    assert buffer.lookup(*asked) == fresh.lookup(*asked) != before


def test_gyroscope_whose_samples_have_expired_is_not_followed_any_more(truth):
    """Its window ends at its own newest sample, which may be newer than the newest pose."""
    buffer = BufferCore(cache_time=SECOND)
    for stamp in POSES[:20].tolist():
        buffer.insert('odom', 'base', stamp, Pose(x=stamp / SECOND))
    buffer.aid('base', STAMPS[:1000], rate_at(STAMPS[:1000]))
    asked = int(POSES[3]) + 7_000_000
    turned = buffer.lookup('odom', 'base', asked)
    assert se3.distance(turned, Pose(x=asked / SECOND))[1] > 1e-3
    buffer.aid('base', STAMPS[1000:], rate_at(STAMPS[1000:]))
    assert_same_pose(buffer.lookup('odom', 'base', asked), Pose(x=asked / SECOND))
