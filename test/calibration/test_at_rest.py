# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Observations that no target at rest explains get no edge, and others are not refused.

The thorough profile of hypothesis takes 60 seeds of each; an ordinary run takes some.
"""

from calibration_scenes import (
    at,
    direction,
    EDGE,
    errors,
    PLACE,
    scene,
    with_target_moved,
)
from hypothesis import settings
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tf_tree_py import BufferCore, screws
from tf_tree_py.calibration import calibrate, Limits, Observations, Verdict
from tf_tree_py.core import Pose, se3, UNLIMITED

NEAR = Limits(max_offset_s=0.2)
SEEDS = range(60) if settings().max_examples >= 200 else (0, 1, 15)
STEADY = {'turned_deg': 0.0, 'offset_s': 0.0}


def changed(given, **changes):
    """Return the observations of a scene with other fields."""
    sets = given.observations
    return Observations(**{'sensor': 'camera', 'stamps': sets.stamps, 'seen': sets.seen,
                           'fixed_in': 'map', **changes})


def points(sets):
    return Observations('camera', sets.stamps, sets.seen[:, :3], 'map')


def known(sets):
    return Observations('camera', sets.stamps, sets.seen, 'map', place=PLACE)


def precise(sets):
    return Observations('camera', sets.stamps, sets.seen, 'map',
                        covariances=np.diag([4e-6] * 6))


def of(make, change):
    """Return a maker of the same scenes with changed observations."""
    def made(seed):
        given, sets = make(seed)
        return given, change(sets)
    return made


# --- observations of nothing

def at_random(seed, count=260):
    rng = np.random.default_rng(10_000 + seed)
    given = scene(seed, count, **STEADY)
    return given, changed(given, seen=np.concatenate([
        rng.normal(size=(count, 3)) + [0.0, 0.0, 3.0], Rotation.random(count, rng).as_quat()],
        axis=1))


def shuffled(seed):
    given = scene(seed, **STEADY)
    order = np.random.default_rng(seed).permutation(len(given.observations))
    return given, changed(given, seen=given.observations.seen[order])


def of_another_run(seed):
    given = scene(seed, **STEADY)
    return given, changed(given, seen=scene(seed + 5000, **STEADY).observations.seen)


def few_at_random(seed):
    return at_random(seed, 12)


@pytest.mark.parametrize('make', [
    at_random, shuffled, of_another_run, of(at_random, points), of(shuffled, points),
    of(at_random, precise), of(at_random, known)])
def test_observations_of_nothing_get_no_edge(make):
    for seed in SEEDS:
        given, sets = make(seed)
        found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
        assert found.verdict is Verdict.UNKNOWN, seed
        assert 'do not fit one target at rest' in found.contradiction.what, seed
        assert errors(found.edge.after, found.edge.before) == pytest.approx(np.zeros(6), abs=1e-12)
        assert np.diag(found.edge.covariance) == pytest.approx([0.01] * 6)
        assert found.time_offset_s == 0.0 and found.time_offset_sigma_s == pytest.approx(0.1)


def test_few_observations_of_nothing_get_no_edge():
    for seed in SEEDS:
        given, sets = few_at_random(seed)
        found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
        assert found.verdict is Verdict.UNKNOWN, seed


def test_detector_without_rotations_is_named():
    for seed in SEEDS:
        given = scene(seed, **STEADY)
        seen = given.observations.seen.copy()
        seen[:, 3:] = 0.0, 0.0, 0.0, 1.0
        against = calibrate(given.buffer, EDGE, changed(given, seen=seen), time=True,
                            limits=NEAR).contradiction
        assert 'the rotations that camera saw' in against.what and 'points' in against.remedy


# --- a target that moves

def driving(seed, **scene_of):
    given = scene(seed, **STEADY, **scene_of)
    return given, with_target_moved(
        given, lambda seconds: 0.15 * seconds[:, None] * direction(seed))


def swinging(seed):
    given = scene(seed, **STEADY)
    return given, with_target_moved(
        given, lambda seconds: 0.3 * np.sin(0.5 * seconds)[:, None] * direction(seed))


@pytest.mark.parametrize('make', [
    driving, of(driving, points), of(driving, known), of(driving, precise), swinging,
    lambda seed: driving(seed, planar=True), lambda seed: driving(seed, count=40),
    lambda seed: driving(seed, speed=0.0)])
def test_target_that_moves_is_said_to_move(make):
    for seed in SEEDS:
        given, sets = make(seed)
        found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
        assert found.verdict is Verdict.UNKNOWN, seed
        assert "'target' moves in map, by " in found.contradiction.what, seed


def test_speed_of_the_target_is_stated():
    given, sets = driving(1)
    found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
    assert found.contradiction.what.endswith('by 2.2 m, at about 0.15 m/s')
    assert '--fixed-in' in found.contradiction.remedy


# --- two targets

@pytest.mark.parametrize('share, apart', [(0.5, 1.0), (0.5, 0.3), (0.4, 1.0)])
def test_two_targets_of_one_name_are_said_to_be_two(share, apart):
    for seed in SEEDS:
        given = scene(seed, **STEADY)
        other = np.random.default_rng(seed).random(len(given.observations)) < share
        sets = with_target_moved(
            given, lambda _, other=other, seed=seed: apart * other[:, None] * direction(seed))
        found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
        assert found.verdict is Verdict.UNKNOWN, seed
        assert "'target' is at two places in map, " in found.contradiction.what, seed
        named = [Observations('camera', sets.stamps[kept], sets.seen[kept], 'map', name)
                 for name, kept in (('one', other), ('two', ~other))]
        assert calibrate(given.buffer, EDGE, named, time=True,
                         limits=NEAR).contradiction is None, seed


# --- one target at rest

def drifting(seed):
    """Return a robot whose odometry drifts by 3 % of its way."""
    given = scene(seed, **STEADY)
    way = given.buffer.lookup_many('map', 'base', given.observations.stamps)[:, :3]
    path = np.concatenate([[0.0], np.linalg.norm(np.diff(way, axis=0), axis=1).cumsum()])
    return given, with_target_moved(given, lambda _: 0.03 * path[:, None] * direction(seed))


def biased(seed):
    """Return a detector with an error of 2 cm that depends on the view."""
    given = scene(seed, offset_s=0.0)
    way = given.buffer.lookup_many('map', 'base', given.observations.stamps)[:, :3]
    seen = given.observations.seen.copy()
    seen[:, :3] += 0.02 * np.sin(2.0 * way @ np.random.default_rng(seed).normal(size=(3, 3)))
    return given, changed(given, seen=seen)


def at_stops(seed, stops=8):
    """Return an arm that rests at some poses, and moves between them."""
    rng = np.random.default_rng(seed)
    poses = np.concatenate([rng.uniform(-0.3, 0.3, (stops, 3)), Rotation.from_rotvec(
        rng.uniform(-0.5, 0.5, (stops, 3))).as_quat()], axis=1)
    buffer = BufferCore(cache_time=UNLIMITED)
    seconds = np.arange(0.0, 2.0 * stops, 2.0)
    buffer.insert_track('map', 'base', at(np.sort([*seconds, *(seconds + 1.0)])),
                        np.repeat(poses, 2, axis=0))
    given = scene(seed, offset_s=0.0)
    buffer.insert(*EDGE, 0, given.buffer.lookup(*EDGE), static=True)
    taken = at((seconds[:, None] + np.linspace(0.3, 0.7, 5)).ravel())
    camera = se3.compose_many(buffer.lookup_many('map', 'base', taken),
                              np.tile(given.true, (len(taken), 1)))
    seen = se3.compose_many(se3.inverse_many(camera), np.tile(PLACE, (len(taken), 1)))
    seen = se3.compose_many(seen, screws.exp_many(0.002 * rng.normal(size=(len(taken), 6))))
    return given._replace(buffer=buffer), Observations('camera', taken, seen, 'map')


def turned_over(seed, images=10):
    """Return a detector that sees a flat target turned over in a fifth of the images, in runs."""
    given = scene(seed, 300, offset_s=0.0)
    runs = np.random.default_rng(seed).permutation(300 // images) < 60 // images
    over = np.repeat(runs, images)[:, None]
    turned = se3.compose_many(given.observations.seen, np.tile(
        Pose.from_xyz_rpy(roll=0.7, pitch=0.4), (300, 1)))
    return given, changed(given, seen=np.where(over, turned, given.observations.seen))


def as_it_is(**scene_of):
    def make(seed):
        given = scene(seed, **scene_of)
        return given, given.observations
    return make


@pytest.mark.parametrize('make, verdicts', [
    (as_it_is(**STEADY), {Verdict.NOTHING}), (as_it_is(), {Verdict.BOTH}),
    (as_it_is(offset_s=0.0, planar=True), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, turning=0.0), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, outliers=0.3), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, outliers=0.45), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, turned_deg=10.0, noise_m=0.05, noise_rad=0.05), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, turned_deg=3.0, turning=0.03, driving=0.03), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, speed=0.2), {Verdict.EDGE}),
    (as_it_is(offset_s=0.0, count=600, duration_s=120.0), {Verdict.EDGE}),
    (at_stops, {Verdict.EDGE}), (biased, {Verdict.EDGE}), (turned_over, {Verdict.EDGE}),
    (lambda seed: turned_over(seed, 30), {Verdict.EDGE}),
    (drifting, {Verdict.NOTHING, Verdict.EDGE, Verdict.TIME, Verdict.UNKNOWN})])
def test_target_at_rest_is_not_refused(make, verdicts):
    wrong = []
    for seed in SEEDS:
        given, sets = make(seed)
        found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
        assert found.contradiction is None, (seed, found.contradiction)
        wrong += [] if found.verdict in verdicts else [(seed, str(found.verdict))]
    assert len(wrong) <= 0.05 * len(SEEDS), wrong


def test_one_bad_target_of_several_is_named():
    given, sets = driving(1)
    named = [given.observations,
             Observations('camera', sets.stamps, sets.seen, 'map', 'cart')]
    against = calibrate(given.buffer, EDGE, named, time=True, limits=NEAR).contradiction
    assert "'cart' moves in map" in against.what and "or leave 'cart' out" in against.remedy


def test_offset_beyond_the_largest_is_a_remedy():
    for offset_s, begin in ((0.5, 'try a larger --max-offset, because the time of camera is'),
                            (1.0, 'fasten the target')):
        given = scene(0, turned_deg=0.0, offset_s=offset_s, speed=2.0)
        remedy = calibrate(given.buffer, EDGE, given.observations, time=True,
                           limits=NEAR).contradiction.remedy
        assert remedy.startswith(begin) and '--max-offset' in remedy


def test_detector_that_confuses_two_rotations_is_named():
    for seed in SEEDS:
        given = scene(seed, **STEADY)
        over = np.random.default_rng(seed).random(len(given.observations)) < 0.5
        turned = se3.compose_many(given.observations.seen, np.tile(
            Pose.from_xyz_rpy(roll=0.7), (len(over), 1)))
        against = calibrate(given.buffer, EDGE, changed(given, seen=np.where(
            over[:, None], turned, given.observations.seen)), time=True, limits=NEAR).contradiction
        assert 'confuses two rotations' in against.remedy, (seed, against)


def test_slow_error_of_a_detector_is_no_motion():
    given = scene(0, **STEADY, speed=0.0)
    sets = with_target_moved(given, lambda seconds: 0.01 * np.sin(seconds)[:, None] * direction(0))
    found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
    assert found.contradiction is None and found.all_at_one_place


def test_marker_on_the_hand_is_not_refused():
    for seed in SEEDS:
        given = scene(seed, offset_s=0.0)
        given.buffer.insert('map', 'eye', 0, PLACE, static=True)
        sets = Observations('eye', given.observations.stamps,
                            se3.inverse_many(given.observations.seen), 'camera', place=Pose())
        assert calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR).contradiction is None
