# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Corrections without a jump: each guarantee, also with many writers and readers at once."""

import itertools
import pickle
import random
import threading

from crew import Crew, PATIENCE_S
from inputs import for_each
import numpy as np
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, load, Spline
from tf_tree_py.beyond.motion.twist import lookup_twist_many
from tf_tree_py.core import InvalidArgumentException, Pose, se3, TransformException, UNLIMITED
from tf_tree_py.core.messages.incidents import TransformWarning

SECOND = 1_000_000_000
MS = 1_000_000
STEP = 10 * MS
MAX_SPEED, MAX_TURN_RATE = 0.3, 0.2
BOUNDS = {'max_speed': MAX_SPEED, 'max_turn_rate': MAX_TURN_RATE}
SHIFT = Pose.from_xyz_rpy(x=0.4, y=-0.2, yaw=0.1)
FIXED = Pose(x=1.0, y=2.0)


def driven(stamp):
    """Return the robot's pose from an odometry: a circle, at 0.5 m/s."""
    t = stamp / SECOND
    return Pose.from_xyz_rpy(x=np.sin(0.5 * t), y=1.0 - np.cos(0.5 * t), yaw=0.5 * t)


def fed(until, buffer=None, since=0):
    """Return a buffer whose edges reach a stamp: map -> odom -> base -> camera."""
    buffer = buffer or BufferCore(UNLIMITED)
    buffer.insert('base', 'camera', 0, Pose(z=1.0), static=True)
    for stamp in range(since, until + 1, STEP):
        buffer.insert('map', 'odom', stamp, FIXED)
        buffer.insert('odom', 'base', stamp, driven(stamp))
    return buffer


def answers(buffer, stamps):
    return [buffer.lookup_at('map', 'camera', stamp) for stamp in stamps]


# --- returned results do not change

def test_no_answer_that_was_given_changes_nor_one_before_the_blend():
    buffer = fed(2 * SECOND)
    stamps = [*range(0, 2 * SECOND + 1, 7 * MS), 2 * SECOND]
    before = answers(buffer, stamps)
    of_base = buffer.correct('base', SHIFT, over=SECOND // 2)
    of_odom = buffer.correct('odom', SHIFT, over=SECOND // 2)
    assert of_base.begin == of_odom.begin == 2 * SECOND
    assert answers(buffer, stamps) == before
    fed(4 * SECOND, buffer, since=2 * SECOND + STEP)
    assert answers(buffer, stamps) == before


@for_each(insert=[
    lambda buffer, stamp: buffer.insert('odom', 'base', stamp, driven(stamp)),
    lambda buffer, stamp: buffer.insert_track('odom', 'base', [stamp], [driven(stamp)])])
def test_newest_sample_that_is_sent_again_stays_as_it_was_answered(insert):
    """The blend begins with this sample: moved by the blend, its last bits would differ."""
    buffer = BufferCore(UNLIMITED)
    for stamp in range(0, 2 * SECOND, STEP):
        insert(buffer, stamp)
        answered = buffer.lookup_at('odom', 'base', stamp)
        if stamp % (100 * MS) == 0:
            buffer.correct('base', Pose.from_xyz_rpy(y=stamp / SECOND, yaw=0.3), over=SECOND)
            insert(buffer, stamp)
            assert buffer.lookup_at('odom', 'base', stamp) == answered


def test_late_sample_of_an_earlier_blend_is_moved_by_that_one():
    buffer, late = fed(SECOND), SECOND + 200 * MS
    buffer.correct('base', SHIFT, over=SECOND)
    fed(late, buffer, since=SECOND + STEP)
    answered = buffer.lookup_at('odom', 'base', late)
    fed(SECOND + 500 * MS, buffer, since=late + STEP)
    buffer.correct('base', Pose(y=0.5), over=SECOND)
    buffer.insert('odom', 'base', late, driven(late))
    assert buffer.lookup_at('odom', 'base', late) == answered


@for_each(act=[
    lambda buffer: buffer.correct('base', SHIFT),
    lambda buffer: buffer.lookup('map', 'camera'),
    lambda buffer: buffer.lookup_at('map', 'camera', SECOND // 2),
    lambda buffer: buffer.lookup_many('map', 'camera', [SECOND // 2]),
    lambda buffer: buffer.lookup_tree('map'),
    lambda buffer: buffer.lookup_uncertain('map', 'camera'),
    lambda buffer: buffer.snapshot(),
    lambda buffer: buffer.smoothed()])
def test_corrections_and_lookups_wait_for_who_is_inside_the_buffer(act):
    """So none sees another's partial change."""
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT)
    visitor = threading.Thread(target=act, args=(buffer,))
    with buffer.intake.lock:
        visitor.start()
        visitor.join(0.05)  # without the lock, a millisecond is enough
        assert visitor.is_alive()
    visitor.join()


def test_from_its_end_on_the_correction_holds_wholly():
    buffer = fed(SECOND)
    change = buffer.correct('base', SHIFT, over=SECOND // 2)
    fed(3 * SECOND, buffer, since=SECOND + STEP)
    for stamp in (change.end, 3 * SECOND):
        assert_same_pose(buffer.lookup_at('odom', 'base', stamp), SHIFT @ driven(stamp))
    assert buffer.correction_of('base') == change.motion == SHIFT
    assert buffer.correction_of('camera') == Pose()


def test_giving_one_twice_does_no_harm():
    buffer, twice = fed(SECOND), fed(SECOND)
    buffer.correct('base', SHIFT, over=SECOND)
    twice.correct('base', SHIFT, over=SECOND)
    twice.correct('base', SHIFT, over=SECOND)
    for each in (buffer, twice):
        fed(2 * SECOND, each, since=SECOND + STEP)
    for stamp in range(0, 2 * SECOND, MS):
        assert_same_pose(buffer.lookup_at('map', 'camera', stamp),
                         twice.lookup_at('map', 'camera', stamp))


def test_late_samples_are_moved_as_their_stamp_has_it():
    stamps = list(range(SECOND + STEP, 2 * SECOND + 1, STEP))
    late = stamps.copy()
    random.Random(1).shuffle(late)
    ordered, shuffled, together = fed(SECOND), fed(SECOND), fed(SECOND)
    for buffer in (ordered, shuffled, together):
        buffer.correct('base', SHIFT, over=SECOND // 2)
    for stamp, other in zip(stamps, late, strict=True):
        ordered.insert('odom', 'base', stamp, driven(stamp))
        shuffled.insert('odom', 'base', other, driven(other))
    together.insert_track('odom', 'base', stamps, [driven(stamp) for stamp in stamps])
    for stamp in range(SECOND, 2 * SECOND, 3 * MS):
        here = ordered.lookup_at('odom', 'base', stamp)
        assert here == shuffled.lookup_at('odom', 'base', stamp)
        assert_same_pose(here, together.lookup_at('odom', 'base', stamp))


# --- not faster than stated

def worst_excess(buffer, target, source, stamps, own):
    """Return the maximum excess of an edge's speed and turn rate over its own motion."""
    poses = buffer.lookup_many(target, source, stamps)
    gone, turned = se3.distance_many(poses[:-1], poses[1:])
    raw = np.array([own(stamp) for stamp in stamps])
    own_gone, own_turned = se3.distance_many(raw[:-1], raw[1:])
    seconds = np.diff(stamps) / SECOND
    return ((gone - own_gone) / seconds).max(), ((turned - own_turned) / seconds).max()


@for_each(every=[2, 200])
def test_no_edge_is_faster_than_its_own_motion_and_the_stated_rate(every):
    rng = np.random.default_rng(3)
    buffer = fed(0)
    stamps = np.arange(0, 4 * SECOND, STEP)
    for number, stamp in enumerate(stamps.tolist()):
        fed(stamp, buffer, since=stamp)
        if number % every == 0:
            x, y, yaw = rng.uniform(-0.4, 0.4, 3)
            for child in ('base', 'odom'):
                buffer.correct(child, Pose.from_xyz_rpy(x=x, y=y, yaw=yaw), over=0, **BOUNDS)
    for target, source, own in (('odom', 'base', driven), ('map', 'odom', lambda _: FIXED)):
        speed, turn_rate = worst_excess(buffer, target, source, stamps, own)
        assert speed <= MAX_SPEED + 1e-9
        assert turn_rate <= MAX_TURN_RATE + 1e-9
        assert turn_rate > 0.1 * MAX_TURN_RATE or every < 200  # it moves


@for_each(other=[3.0, -2.0])
def test_one_that_comes_at_the_peak_of_another_is_no_faster_either(other):
    """The current rate and the new path add up, most of all where the path leads back."""
    buffer = fed(SECOND)
    change = buffer.correct('odom', Pose(x=1.0), over=0, **BOUNDS)
    middle = (change.begin + change.end) // 2 // STEP * STEP
    fed(middle, buffer, since=SECOND + STEP)
    last = buffer.correct('odom', Pose(x=other), over=0, **BOUNDS).end // STEP * STEP
    for stamp in range(middle + STEP, last, STEP):
        buffer.insert('map', 'odom', stamp, FIXED)
    speed, _ = worst_excess(buffer, 'map', 'odom', np.arange(SECOND, last, STEP), lambda _: FIXED)
    assert 0.99 * MAX_SPEED < speed <= MAX_SPEED + 1e-9


def test_turn_alone_is_no_faster_than_stated():
    buffer, change = BufferCore(UNLIMITED), None
    for stamp in range(0, 10 * SECOND, STEP):
        buffer.insert('map', 'odom', stamp, Pose())
        if stamp == SECOND:
            change = buffer.correct('odom', Pose.from_xyz_rpy(yaw=0.4), over=0, **BOUNDS)
        elif change and stamp == (change.begin + change.end) // 2 // STEP * STEP:
            buffer.correct('odom', Pose.from_xyz_rpy(roll=0.2, yaw=-0.2), over=0, **BOUNDS)
    _, turn_rate = worst_excess(
        buffer, 'map', 'odom', np.arange(0, 10 * SECOND, STEP), lambda _: Pose())
    assert 0.99 * MAX_TURN_RATE < turn_rate <= MAX_TURN_RATE + 1e-9


def test_new_pivot_during_a_blend_begins_with_its_rate_there():
    buffer = fed(SECOND)
    buffer.correct('odom', Pose.from_xyz_rpy(yaw=0.4), over=SECOND)
    fed(SECOND + 500 * MS, buffer, since=SECOND + STEP)
    buffer.correct('odom', Pose.from_xyz_rpy(yaw=0.4), over=SECOND, about=(5.0, 0.0, 0.0))
    fed(2 * SECOND, buffer, since=SECOND + 500 * MS + STEP)
    poses = buffer.lookup_many('map', 'odom', np.arange(SECOND, 2 * SECOND, STEP))
    arm = np.broadcast_to((5.0, 0.0, 0.0), (len(poses), 3))
    velocities = np.diff(se3.apply_many(poses, arm), axis=0) / (STEP / SECOND)
    # It moves at about 4 m/s; a jump of that velocity would show in one step.
    assert np.linalg.norm(velocities, axis=1).max() > 3.0
    assert np.abs(np.diff(velocities, axis=0)).max() < 0.4


def test_what_hangs_below_within_reach_of_the_pivot_is_no_faster_either():
    buffer = fed(SECOND)
    robot = np.array((5.0, 0.0, 0.0))  # in odom, far from its origin
    buffer.correct('odom', Pose.from_xyz_rpy(y=0.5, yaw=0.3), over=0, about=robot, reach=0.5,
                   **BOUNDS)
    fed(8 * SECOND, buffer, since=SECOND + STEP)
    poses = buffer.lookup_many('map', 'odom', np.arange(SECOND, 8 * SECOND, STEP))
    for arm in ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (-0.3, 0.4, 0.0)):
        places = se3.apply_many(poses, np.broadcast_to(robot + arm, (len(poses), 3)))
        speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / (STEP / SECOND)
        assert 0.3 * MAX_SPEED < speeds.max() <= MAX_SPEED + 1e-9


def test_one_that_comes_during_another_begins_with_its_value_and_rate():
    buffer = fed(SECOND)
    buffer.correct('odom', SHIFT, over=SECOND)
    fed(SECOND + 400 * MS, buffer, since=SECOND + STEP)
    buffer.correct('odom', Pose(y=0.5), over=SECOND)
    fed(3 * SECOND, buffer, since=SECOND + 400 * MS + STEP)
    stamps = np.arange(SECOND, 3 * SECOND, STEP)
    velocities = np.diff(buffer.lookup_many('map', 'odom', stamps), axis=0) / (STEP / SECOND)
    # It accelerates by at most about 6 m/s^2; a jump would be 0.5 m/s in one step.
    assert np.abs(np.diff(velocities[:, :3], axis=0)).max() < 0.1
    assert np.abs(velocities[40, :3]).max() > 0.3


# --- uncertainty

def test_covariance_is_inflated_while_a_blend_lasts():
    buffer = fed(SECOND)
    change = buffer.correct('base', SHIFT, over=SECOND)
    fed(3 * SECOND, buffer, since=SECOND + STEP)
    middle = (change.begin + change.end) // 2
    spread = buffer.lookup_uncertain('odom', 'base', middle)[1]
    error = np.subtract((SHIFT @ driven(middle))[:3], buffer.lookup_at('odom', 'base', middle)[:3])
    np.testing.assert_allclose(spread[:3, :3], np.outer(error, error), atol=1e-12)
    assert spread[5, 5] == pytest.approx(0.05 ** 2)
    many = buffer.lookup_uncertain_many('odom', 'base', [SECOND // 2, middle, 3 * SECOND])[1]
    np.testing.assert_allclose(many, [np.zeros((6, 6)), spread, np.zeros((6, 6))], atol=1e-15)
    assert [share.child for share in buffer.lookup_budget('map', 'camera', middle)] == ['base']


def test_covariance_of_the_edge_itself_is_added_and_a_prediction_has_both():
    buffer = fed(SECOND)
    buffer.insert('odom', 'base', SECOND, driven(SECOND), covariance=1e-4 * np.eye(6))
    buffer.correct('base', Pose(x=0.4), over=SECOND)
    fed(SECOND + 500 * MS, buffer, since=SECOND + STEP)
    spread = buffer.lookup_uncertain('odom', 'base')[1]
    assert spread[0, 0] == pytest.approx(0.2 ** 2 + 1e-4)
    ahead = buffer.predict('odom', 'base', SECOND + 510 * MS, SECOND).covariance
    assert ahead[0, 0] >= 0.2 ** 2


# --- full corrections on demand

def test_smoothed_has_every_correction_at_the_stamp_it_was_seen_at():
    buffer = fed(SECOND)
    buffer.correct('base', Pose(x=0.1), over=SECOND, stamp=200 * MS)
    fed(2 * SECOND, buffer, since=SECOND + STEP)
    buffer.correct('base', Pose(x=0.3), over=SECOND, stamp=1200 * MS)
    fed(3 * SECOND, buffer, since=2 * SECOND + STEP)
    before = answers(buffer, range(0, 3 * SECOND, MS))
    whole = buffer.smoothed()
    for stamp, x in ((0, 0.1), (200 * MS, 0.1), (700 * MS, 0.2), (1200 * MS, 0.3),
                     (3 * SECOND, 0.3)):
        assert_same_pose(whole.lookup_at('odom', 'base', stamp), Pose(x=x) @ driven(stamp))
    assert answers(buffer, range(0, 3 * SECOND, MS)) == before
    assert whole.lookup('map', 'odom') == FIXED


def test_smoothed_of_a_buffer_without_corrections_is_its_snapshot():
    buffer = fed(SECOND)
    stamps = range(0, SECOND, 3 * MS)
    assert answers(buffer.smoothed(), stamps) == answers(buffer.snapshot(), stamps)


# --- combined with other features

def test_a_gyroscope_still_tells_what_lies_between_two_poses():
    stamps = np.arange(0, 3 * SECOND, MS)
    rates = np.stack([0 * stamps, 0 * stamps, 3.0 * np.sin(stamps / 2e7)], axis=1)
    poses = {}
    for order in itertools.permutations(['aid', 'correct']):
        buffer = fed(SECOND)
        for step in order:
            if step == 'aid':
                buffer.aid('base', stamps, rates)
            else:
                buffer.correct('base', SHIFT, over=SECOND // 2)
        fed(2 * SECOND, buffer, since=SECOND + STEP)
        poses[order] = buffer.lookup_many('odom', 'base', stamps[:-SECOND // MS])
    first, second = poses.values()
    # Not to the last bit: numpy's rounding depends on the alignment in memory.
    np.testing.assert_allclose(first, second, rtol=0.0, atol=1e-14)
    straight = fed(2 * SECOND)
    straight.aid('base', stamps, rates)
    late = stamps[(stamps > 1500 * MS) & (stamps < 2 * SECOND)]
    expected = se3.compose_many(np.array(SHIFT), straight.lookup_many('odom', 'base', late))
    gone, turned = se3.distance_many(expected, first[late // MS])
    assert gone.max() < 1e-12 and turned.max() < 1e-7


def test_snapshot_keeps_the_blend_and_pickles():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=SECOND)
    fed(SECOND + 500 * MS, buffer, since=SECOND + STEP)
    still = pickle.loads(pickle.dumps(buffer.snapshot()))
    buffer.correct('base', Pose(), over=SECOND)
    assert still.corrections_version == 1 and buffer.corrections_version == 2
    assert still.correction_of('base') == SHIFT
    assert still.lookup_uncertain('odom', 'base')[1][0, 0] > 0.0


def test_snapshot_knows_nothing_of_what_comes_later():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=SECOND)
    fed(SECOND + 500 * MS, buffer, since=SECOND + STEP)
    still = buffer.snapshot()
    pose, covariance = still.lookup_uncertain('odom', 'base')
    buffer.correct('base', Pose(x=3.0), over=SECOND)
    assert still.correction_of('base') == SHIFT
    again = still.lookup_uncertain('odom', 'base')
    assert again[0] == pose
    np.testing.assert_allclose(again[1], covariance, rtol=0.0, atol=1e-14)


def test_saved_blend_is_answered_as_it_was(tmp_path):
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=2 * SECOND)
    fed(2 * SECOND, buffer, since=SECOND + STEP)
    buffer.save(tmp_path / 'tree')
    loaded, stamps = load(tmp_path / 'tree'), np.arange(0, 2 * SECOND, 41 * MS)
    for there, here in zip(loaded.lookup_uncertain_many('odom', 'base', stamps),
                           buffer.lookup_uncertain_many('odom', 'base', stamps), strict=True):
        np.testing.assert_allclose(there, here, rtol=0.0, atol=1e-14)
    assert (loaded.correction_of('base'), loaded.corrections_version) == (SHIFT, 1)


def test_every_kind_of_lookup_is_the_same_during_a_blend():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=0, **BOUNDS)
    fed(4 * SECOND, buffer, since=SECOND + STEP)
    stamps = np.arange(SECOND, 3 * SECOND, 87 * MS)
    many = buffer.lookup_many('odom', 'base', stamps)
    covariances = buffer.lookup_uncertain_many('odom', 'base', stamps)[1]
    twists = lookup_twist_many(buffer, 'base', 'odom', stamps, averaging_interval=STEP)
    assert 0.5 < np.linalg.norm(twists[:, :3], axis=1).max() <= 0.5 + MAX_SPEED
    for number, stamp in enumerate(stamps.tolist()):
        assert_same_pose(buffer.lookup_at('odom', 'base', stamp), many[number], 1e-13)
        assert_same_pose(buffer.lookup_tree('odom', stamp)['base'], many[number], 1e-13)
        np.testing.assert_allclose(buffer.lookup_uncertain('odom', 'base', stamp)[1],
                                   covariances[number], atol=1e-13)


def test_window_that_is_shorter_than_the_blend_changes_nothing():
    short = fed(SECOND, BufferCore(200 * MS))
    long = fed(SECOND)
    for buffer in (short, long):
        buffer.correct('base', SHIFT, over=3 * SECOND, **BOUNDS)
    for since in range(SECOND + STEP, 5 * SECOND, 100 * MS):
        for buffer in (short, long):
            fed(since + 90 * MS, buffer, since=since)
        assert short.lookup('odom', 'base') == long.lookup('odom', 'base')


def test_edge_that_becomes_static_during_a_blend_forgets_it():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=SECOND)
    buffer.insert('odom', 'base', 0, FIXED, static=True, strict=False)
    assert buffer.lookup('odom', 'base') == FIXED and buffer.correction_of('base') == Pose()
    with pytest.warns(TransformWarning, match='dynamic'):
        fed(2 * SECOND, buffer, since=SECOND + STEP)
    assert buffer.lookup('odom', 'base') == driven(2 * SECOND)


def test_stamps_that_jump_back_during_a_blend_end_it():
    buffer = fed(3 * SECOND, BufferCore(clear_on_jump_back=SECOND))
    buffer.correct('base', SHIFT, over=9 * SECOND)
    with pytest.warns(TransformWarning, match='jumped back'):
        fed(2 * SECOND, buffer)
    assert_same_pose(buffer.lookup('odom', 'base'), driven(2 * SECOND))
    assert buffer.correction_of('base') == Pose() and buffer.corrections_version == 1


def test_after_clear_samples_come_as_they_are():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=SECOND)
    buffer.clear()
    fed(SECOND, buffer)
    assert_same_pose(buffer.lookup('odom', 'base', SECOND), driven(SECOND))
    buffer.correct('base', SHIFT, over=SECOND // 2)
    fed(2 * SECOND, buffer, since=SECOND + STEP)
    assert_same_pose(buffer.lookup('odom', 'base', 2 * SECOND), SHIFT @ driven(2 * SECOND))


def test_samples_of_another_parent_are_not_moved():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=0)
    buffer.insert('elevator', 'base', SECOND + STEP, FIXED, strict=False)
    assert buffer.lookup('elevator', 'base', SECOND + STEP) == FIXED
    buffer.insert('odom', 'base', SECOND + 2 * STEP, driven(SECOND), strict=False)
    assert_same_pose(buffer.lookup('odom', 'base', SECOND + 2 * STEP), SHIFT @ driven(SECOND))


def test_what_cannot_be_corrected_says_why():
    buffer = fed(SECOND)
    stamps = np.arange(0, SECOND, STEP)
    buffer.insert_curve('base', 'arm', Spline.fit(
        stamps, np.tile(se3.IDENTITY, (len(stamps), 1)), 10.0))
    for child, why in (('camera', 'is static'), ('arm', 'is a curve'), ('map', 'no edge'),
                       ('nobody', 'no edge'), ('', 'name of a frame'), (3, 'frame')):
        with pytest.raises(InvalidArgumentException, match=why):
            buffer.correct(child, SHIFT)
    for wrong in ({'over': 0.5}, {'over': -1}, {'max_speed': 0.0}, {'max_turn_rate': 'fast'},
                  {'max_speed': float('nan')}, {'reach': float('inf')}, {'about': (1.0, 2.0)},
                  {'about': (1.0, 2.0, np.nan)}, {'stamp': 2 * SECOND}, {'stamp': 1.5}):
        with pytest.raises(InvalidArgumentException):
            buffer.correct('base', SHIFT, **wrong)
    with pytest.raises(InvalidArgumentException):
        buffer.correct('base', Pose(x=float('nan')))
    with pytest.raises(InvalidArgumentException, match='64 bits'):
        buffer.correct('base', Pose(x=1e6), max_speed=1e-9)
    assert buffer.corrections_version == 0


def test_what_is_kept_of_corrections_does_not_grow_beyond_the_window():
    buffer = BufferCore(SECOND)
    for stamp in range(0, 10 * SECOND, STEP):
        buffer.insert('odom', 'base', stamp, Pose())
        buffer.correct('base', Pose(x=1e-3 * (stamp // STEP % 5)), over=STEP)
    correction = buffer.intake.tree.histories['base'].corrections['odom']
    assert len(correction.measured) < 105 and len(correction.stages) < 105


# --- at the rates of localisers

@for_each(every=[20 * MS, 100 * MS, 500 * MS], limits=[{'max_speed': 0.5}, {}])
def test_one_that_is_sent_again_arrives_as_soon_as_one_that_is_sent_once(every, limits):
    once, often = fed(SECOND), fed(SECOND)
    end = once.correct('base', Pose(y=1.0), **limits).end
    often.correct('base', Pose(y=1.0), **limits)
    for stamp in range(SECOND + STEP, end + STEP, STEP):
        for buffer in (once, often):
            fed(stamp, buffer, since=stamp)
        if stamp % every == 0:
            assert often.correct('base', Pose(y=1.0), **limits) == (
                1, SECOND, end, Pose(y=1.0))
        assert often.lookup('odom', 'base') == once.lookup('odom', 'base')
    assert_same_pose(often.lookup('odom', 'base'), Pose(y=1.0) @ driven(stamp), 1e-9)


@for_each(limits=[BOUNDS, {}])
def test_opposite_quaternion_is_the_same_rotation_that_is_sent_again(limits):
    once, often = fed(SECOND), fed(SECOND)
    opposite = Pose(*SHIFT[:3], *(-part for part in SHIFT[3:]))
    change = once.correct('base', SHIFT, **limits)
    for stamp in range(SECOND, 3 * SECOND, STEP):
        assert often.correct('base', (SHIFT, opposite)[stamp // STEP % 2], **limits) == change
        for buffer in (once, often):
            fed(stamp, buffer, since=stamp)
        assert often.lookup('odom', 'base') == once.lookup('odom', 'base')


def test_same_is_what_was_sent_last_for_this_parent():
    buffer = fed(SECOND)
    change = buffer.correct('base', SHIFT, **BOUNDS)
    buffer.insert('lift', 'base', SECOND + STEP, FIXED, strict=False)
    assert buffer.correct('base', SHIFT, about=CENTRE).version == 2  # the first of this parent
    buffer.insert('odom', 'base', SECOND + 2 * STEP, driven(SECOND), strict=False)
    assert buffer.correct('base', SHIFT, **BOUNDS)[1:] == change[1:]
    assert buffer.corrections_version == 2
    assert buffer.correct('base', SHIFT, about=CENTRE).version == 3


def test_first_correction_after_clear_changes_nothing_that_was_answered():
    buffer = fed(3 * SECOND)
    buffer.correct('base', SHIFT)
    buffer.clear()
    for stamp in range(0, SECOND + 1, STEP):
        buffer.insert('odom', 'base', stamp, driven(stamp), covariance=1e-4 * np.eye(6))
    before = buffer.lookup_uncertain('odom', 'base', SECOND // 2 + MS)
    buffer.correct('base', Pose(x=13.0))
    after = buffer.lookup_uncertain('odom', 'base', SECOND // 2 + MS)
    assert after[0] == before[0]
    np.testing.assert_array_equal(after[1], before[1])
    buffer.insert('odom', 'base', SECOND // 2 + 5 * MS, driven(SECOND // 2 + 5 * MS))
    assert_same_pose(buffer.lookup_at('odom', 'base', SECOND // 2 + 5 * MS),
                     driven(SECOND // 2 + 5 * MS))


def test_parent_that_comes_back_has_its_correction_still():
    buffer = fed(SECOND)
    change = buffer.correct('base', SHIFT)
    fed(change.end + STEP, buffer, since=SECOND + STEP)
    late = SECOND + 250 * MS
    expected = buffer.lookup_at('odom', 'base', late)
    buffer.insert('lift', 'base', 2 * SECOND, FIXED, strict=False)
    buffer.correct('base', Pose(x=13.0), over=0)
    buffer.insert('lift', 'base', 2 * SECOND + STEP, FIXED)
    assert_same_pose(buffer.lookup('lift', 'base'), Pose(x=13.0) @ FIXED)
    buffer.insert('odom', 'base', late, driven(late), strict=False)
    assert buffer.lookup_at('odom', 'base', late) == expected
    buffer.insert('odom', 'base', 3 * SECOND, driven(3 * SECOND), strict=False)
    assert_same_pose(buffer.lookup('odom', 'base'), SHIFT @ driven(3 * SECOND))


def circled(stamp):
    """Return a base at 2 m/s and 2 rad/s around a fixed point 1 m to its left."""
    t = 2.0 * stamp / SECOND
    return Pose.from_xyz_rpy(x=np.sin(t), y=1.0 - np.cos(t), yaw=t)


CENTRE = (0.0, 1.0, 0.0)


def places_of(buffer, stamps, point):
    poses = buffer.lookup_many('odom', 'base', stamps)
    return se3.apply_many(poses, np.broadcast_to(point, (len(poses), 3)))


def test_point_beside_a_turning_child_moves_with_the_remaining_angle():
    """It rotates with the child, whose rotation is not yet corrected."""
    buffer = BufferCore(UNLIMITED)
    limits = {'max_speed': 0.1, 'max_turn_rate': 0.1, 'reach': 1.0, 'over': 0}
    for stamp in range(0, 25 * SECOND, STEP):
        buffer.insert('odom', 'base', stamp, circled(stamp))
        if stamp == SECOND:
            goal = Pose.from_xyz_rpy(yaw=0.5)
            buffer.correct('base', goal, **limits)
    stamps = np.arange(SECOND, 25 * SECOND, STEP)
    gone = np.linalg.norm(np.diff(places_of(buffer, stamps, CENTRE), axis=0), axis=1)
    ends = np.array([goal @ circled(stamp) for stamp in stamps.tolist()])
    left = se3.distance_many(buffer.lookup_many('odom', 'base', stamps), ends)[1]
    speeds = gone / (STEP / SECOND)
    assert speeds.max() > 0.5
    own_turn = 2.0
    assert (speeds <= 0.1 + 2.0 * np.sin(0.5 * left[:-1]) * own_turn + 1e-9).all()
    assert speeds[-1] < 1e-6


def test_new_pivot_of_a_turning_child_begins_with_its_velocity():
    buffer = BufferCore(UNLIMITED)
    goal = Pose.from_xyz_rpy(yaw=0.5)
    for stamp in range(0, 3 * SECOND, STEP // 5):
        buffer.insert('odom', 'base', stamp, circled(stamp))
        if stamp == SECOND:
            buffer.correct('base', goal, over=SECOND)
        elif stamp == SECOND + 300 * MS:
            buffer.correct('base', goal, over=SECOND, about=CENTRE)
    stamps = np.arange(SECOND + 200 * MS, SECOND + 400 * MS, STEP // 5)
    velocities = np.diff(places_of(buffer, stamps, CENTRE), axis=0) / (STEP / 5 / SECOND)
    assert np.linalg.norm(velocities, axis=1).max() > 0.5
    assert np.linalg.norm(np.diff(velocities, axis=0), axis=1).max() < 0.06


@for_each(over=[SECOND, 200 * MS])
def test_velocity_of_another_point_is_within_its_limit_after_half_of_over(over):
    """It begins with 10 m/s there, and noisy corrections follow at 100 Hz."""
    buffer, rng, point = BufferCore(UNLIMITED), np.random.default_rng(0), (5.0, 0.0, 0.0)
    begin = SECOND + 500 * MS
    for stamp in range(0, begin + SECOND, STEP):
        buffer.insert('map', 'odom', stamp, Pose())
        goal = Pose.from_xyz_rpy(yaw=1.0 + rng.normal(0.0, 1e-5))
        if stamp == SECOND:
            buffer.correct('odom', goal, over=SECOND, max_speed=0.5)
        elif stamp >= begin:
            buffer.correct('odom', goal, over=over, max_speed=0.5, about=point)
    stamps = np.arange(begin, begin + SECOND, STEP)
    poses = buffer.lookup_many('map', 'odom', stamps)
    places = se3.apply_many(poses, np.broadcast_to(point, (len(poses), 3)))
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / (STEP / SECOND)
    assert speeds[0] > 9.0
    assert speeds[stamps[:-1] >= begin + over // 2].max() <= 0.5 + 1e-9


def test_switch_during_a_blend_about_another_point_keeps_the_velocity():
    """The robot turns on the spot, so the base has no other velocity than the blend's."""
    buffer = BufferCore(UNLIMITED)
    for stamp in range(0, 2 * SECOND, 2 * STEP):
        for source in ('wheels', 'visual'):
            buffer.insert_from(source, 'odom', 'base', stamp,
                               Pose.from_xyz_rpy(yaw=2.0 * stamp / SECOND))
        if stamp == SECOND:
            goal = Pose.from_xyz_rpy(yaw=0.5)
            buffer.correct('base', goal, over=SECOND, about=(1.0, 0.0, 0.0))
        elif stamp == SECOND + 200 * MS:
            buffer.switch('base', to='visual', over=SECOND)
    stamps = np.arange(SECOND + 100 * MS, SECOND + 300 * MS, 2 * STEP)
    velocities = np.diff(places_of(buffer, stamps, (0, 0, 0)), axis=0) / (2 * STEP / SECOND)
    assert np.linalg.norm(velocities, axis=1).max() > 0.8
    assert np.linalg.norm(np.diff(velocities, axis=0), axis=1).max() < 0.1


def test_jump_during_a_blend_keeps_covariances_already_returned():
    buffer = fed(SECOND)
    buffer.correct('base', SHIFT, over=SECOND)
    fed(SECOND + 500 * MS, buffer, since=SECOND + STEP)
    newest = SECOND + 500 * MS
    before = buffer.lookup_uncertain('odom', 'base', newest)[1]
    assert before[0, 0] > 0.01
    buffer.correct('base', Pose(x=2.0), over=0)
    np.testing.assert_array_equal(buffer.lookup_uncertain('odom', 'base', newest)[1], before)
    many = buffer.lookup_uncertain_many('odom', 'base', [newest - STEP, newest])[1][1]
    np.testing.assert_allclose(many, before, atol=1e-14)


# --- many threads

class Storm:
    """Concurrent odometry, localisation and corrections, and all results returned meanwhile."""

    def __init__(self, seconds):
        self.buffer = fed(0)
        self.buffer.insert('odom', 'arm', 0, Pose(x=1.0))
        self.stamps = np.arange(STEP, seconds * SECOND, STEP)
        self.answered = {}
        self.versions = threading.local()
        self.changes = []
        self.asked = random.Random(5)
        # These spread the corrections over the whole drive, however threads are scheduled: each
        # follows a step of the drive, and at most three are behind.
        self.turns, self.leads = threading.Semaphore(0), threading.Semaphore(3)

    def write_odometry(self):
        for number, stamp in enumerate(self.stamps.tolist()):
            self.buffer.insert('odom', 'base', stamp, driven(stamp))
            self.buffer.insert('odom', 'arm', stamp, Pose(x=1.0))
            if number % 2:
                self.turns.release()
                self.leads.acquire(timeout=PATIENCE_S)

    def write_localisation(self):
        for stamp in self.stamps.tolist():
            self.buffer.insert('map', 'odom', stamp, FIXED)

    def write_corrections(self):
        rng = np.random.default_rng(7)
        for number in range(len(self.stamps) // 2):
            self.turns.acquire(timeout=PATIENCE_S)
            x, y, yaw = rng.uniform(-0.4, 0.4, 3)
            self.changes.append(self.buffer.correct(
                ('base', 'odom', 'arm')[number % 3], Pose.from_xyz_rpy(x=x, y=y, yaw=yaw), over=0,
                **BOUNDS))
            self.leads.release()

    def read_newest(self):
        for ends in (('odom', 'base'), ('map', 'camera')):
            stamp, pose = self.buffer.lookup_stamped(*ends)
            assert self.answered.setdefault((*ends, stamp), pose) == pose

    def read_between(self):
        stamp = self.buffer.latest_common_time('map', 'base')
        stamp = self.asked.randrange(stamp + 1)
        pose = self.buffer.lookup_at('map', 'base', stamp)
        assert self.answered.setdefault(('map', 'base', stamp), pose) == pose

    def read_a_loop(self):
        still = self.buffer.snapshot()
        stamp = self.asked.randrange(still.latest_common_time('base', 'arm') + 1)
        closed = Pose()
        for ends in (('map', 'base'), ('base', 'arm'), ('arm', 'map')):
            try:
                closed @= still.lookup_at(*ends, stamp)
            except TransformException:
                return  # map -> odom does not reach this stamp
        assert_same_pose(closed, Pose(), 1e-12)

    def read_all_frames(self):
        tree = self.buffer.lookup_tree('map')
        assert_same_pose(tree['base'] @ Pose(z=1.0), tree['camera'], 1e-12)

    def read_versions(self):
        for version in (self.buffer.corrections_version,
                        self.buffer.snapshot().corrections_version):
            assert version >= getattr(self.versions, 'last', 0)
            self.versions.last = version


def test_storm_of_writers_and_readers():
    storm = Storm(2)
    crew = Crew()
    for write in (storm.write_odometry, storm.write_localisation, storm.write_corrections):
        crew.write(write)
    for read in (storm.read_newest, storm.read_between, storm.read_a_loop, storm.read_all_frames,
                 storm.read_versions):
        crew.read(read)
    crew.run()
    buffer = storm.buffer
    assert len({change.begin for change in storm.changes}) > 15 and len(storm.answered) > 100
    versions = [change.version for change in storm.changes]
    assert versions == list(range(1, len(versions) + 1))
    # Results returned earlier are still the same, bit by bit.
    for (target, source, stamp), pose in storm.answered.items():
        assert buffer.lookup_at(target, source, stamp) == pose
    for target, source, own in (('odom', 'base', driven), ('map', 'odom', lambda _: FIXED),
                                ('odom', 'arm', lambda _: Pose(x=1.0))):
        speed, turn_rate = worst_excess(buffer, target, source, storm.stamps, own)
        assert speed <= MAX_SPEED + 1e-9 and turn_rate <= MAX_TURN_RATE + 1e-9
