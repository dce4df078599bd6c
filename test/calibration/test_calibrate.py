# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The estimates and verdicts of calibrate on scenes with known truth, and its refusals."""

import json

from calibration_scenes import at, EDGE, errors, PLACE, scene
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.calibration import calibrate, CalibrationError, Limits, Observations, Verdict
from tf_tree_py.core import Pose, se3, UNLIMITED
from tf_tree_py.tools.calibrate.report import advice, hidden

NEAR = Limits(max_offset_s=0.2)


def assert_near(found, true, sigmas=5.0):
    """Assert that the error of an edge matches its covariance."""
    error = errors(found.after, true)
    assert (np.abs(error) <= sigmas * np.sqrt(np.diag(found.covariance))).all(), error


# --- the verdict

@pytest.mark.parametrize('turned_deg, offset_s, verdict', [
    (0.0, 0.0, Verdict.NOTHING), (1.0, 0.0, Verdict.EDGE), (0.0, 0.03, Verdict.TIME),
    (1.0, -0.03, Verdict.BOTH)])
@pytest.mark.parametrize('planar', [False, True])
def test_verdict_names_what_is_wrong(turned_deg, offset_s, verdict, planar):
    given = scene(7, 120, turned_deg=turned_deg, offset_s=offset_s, planar=planar)
    found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
    assert found.verdict is verdict
    assert [each.name for each in found.explanations] == [
        Verdict.NOTHING, Verdict.EDGE, Verdict.TIME, Verdict.BOTH]
    assert abs(found.time_offset_s - offset_s) < 5.0 * found.time_offset_sigma_s < 0.01
    assert_near(found.edge, given.true, 6.0 if not planar else 1e9)


def test_verdict_compares_the_time_also_if_it_is_not_to_be_estimated():
    given = scene(8, 120, turned_deg=0.0, offset_s=0.05)
    found = calibrate(given.buffer, EDGE, given.observations, limits=NEAR)
    assert found.verdict is Verdict.TIME
    assert found.time_offset_s is None and found.time_offset_sigma_s is None


def test_offset_beyond_the_largest_that_was_tried_is_flagged():
    given = scene(8, 60, offset_s=0.15)
    near, far = (calibrate(given.buffer, EDGE, given.observations, time=True,
                           limits=Limits(max_offset_s=most)) for most in (0.1, 0.2))
    assert [each.at_bound for each in (*near.time_offsets, *far.time_offsets)] == [True, False]
    assert 'larger --max-offset: the time of camera is at the bound of 0.1 s' in advice(
        near, True)[0]


def test_one_speed_and_no_turn_cannot_tell_place_from_time():
    buffer = BufferCore(cache_time=UNLIMITED)
    seconds = np.arange(0.0, 12.0, 0.02)
    poses = np.zeros((len(seconds), 7))
    poses[:, 0], poses[:, 6] = 0.5 * seconds, 1.0
    buffer.insert_track('map', 'base', at(seconds), poses)
    buffer.insert('base', 'camera', 0, Pose(x=0.04, z=0.5), static=True)   # 4 cm, or 80 ms
    taken, rng = np.arange(1.0, 11.0, 0.1), np.random.default_rng(1)
    seen = np.tile((3.0, 0.5, 0.2, 0.0, 0.0, 0.0, 1.0), (len(taken), 1))
    seen[:, 0] -= 0.5 * taken
    seen[:, :3] += 0.002 * rng.normal(size=(len(taken), 3))
    sets = Observations('camera', at(taken), seen, 'map', place=(3.0, 0.5, 0.7, 0, 0, 0, 1))
    found = calibrate(buffer, ('base', 'camera'), sets, time=True, limits=NEAR)
    assert found.verdict is Verdict.UNKNOWN
    [unseen] = found.unobservable
    assert 'apart from the time of camera' in unseen.what and 'vary the speed' in unseen.remedy


# --- unobservable directions

def test_robot_that_stands_still_shows_nothing():
    given = scene(3, 60, speed=0.0)
    found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
    assert found.verdict is Verdict.UNKNOWN
    assert len(found.unobservable) == 7 and not found.time_offsets[0].at_bound
    [sentence] = hidden(found)
    assert sentence.startswith('all observations are from one place')
    assert 'turn base about two axes' in sentence
    assert errors(found.edge.after, found.edge.before) == pytest.approx(np.zeros(6), abs=1e-6)
    assert found.time_offset_s == 0.0 and found.time_offset_sigma_s >= 0.099
    assert np.sqrt(np.diag(found.edge.covariance)).min() >= 0.099


def test_planar_robot_does_not_see_the_height():
    given = scene(4, 120, planar=True, moved_m=0.05)
    found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
    [unseen] = found.unobservable
    assert unseen.what == 'the translation along z of base -> camera'
    assert unseen.remedy.startswith('turn base about an axis that is not z')
    assert found.edge.after.z == pytest.approx(found.edge.before.z, abs=1e-9)
    assert np.sqrt(found.edge.covariance[2, 2]) >= 0.099
    assert np.abs(errors(found.edge.after, given.true)[:2]).max() < 0.004


def test_robot_that_never_turns_does_not_see_the_translation():
    given = scene(5, 120, turning=0.0)
    found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
    assert [each.what for each in found.unobservable] == [
        f'the translation along {axis} of base -> camera' for axis in 'xyz']
    assert np.abs(errors(found.edge.after, given.true)[3:]).max() < np.radians(0.2)
    assert found.edge.after[:3] == pytest.approx(found.edge.before[:3], abs=1e-9)


def test_known_place_shows_what_an_unknown_one_hides():
    given = scene(5, 120, turning=0.0, moved_m=0.05)
    known = Observations('camera', given.observations.stamps, given.observations.seen, 'map',
                         place=PLACE)
    found = calibrate(given.buffer, EDGE, known, time=True, limits=NEAR)
    assert not found.unobservable and found.verdict is Verdict.BOTH and not found.places
    assert_near(found.edge, given.true)


# --- initial values and robustness

def test_tree_may_be_far_off():
    given = scene(6, 100, turned_deg=150.0, moved_m=3.0)
    found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR)
    assert_near(found.edge, given.true)


def test_outliers_are_named_and_do_no_harm():
    given = scene(9, 100, outliers=0.2, offset_s=0.0)
    found = calibrate(given.buffer, EDGE, given.observations, limits=NEAR)
    assert_near(found.edge, given.true)
    stamps = given.observations.stamps
    camera = se3.compose_many(given.buffer.lookup_many('map', 'base', stamps),
                              np.tile(given.true, (len(stamps), 1)))
    off = np.linalg.norm(se3.compose_many(camera, given.observations.seen)[:, :3]
                         - PLACE[:3], axis=1)
    assert [each.stamp for each in found.outliers] == stamps[off > 0.05].tolist()


def test_correlated_residuals_make_it_less_sure():
    given = scene(10, 150, turned_deg=0.0, offset_s=0.0)
    slow = np.convolve(np.random.default_rng(2).normal(size=250), np.ones(20), 'same')[:150]
    seen = given.observations.seen.copy()
    seen[:, 2] += 0.004 * slow
    drifting = Observations('camera', given.observations.stamps, seen, 'map')
    sure, unsure = (calibrate(given.buffer, EDGE, sets, limits=NEAR)
                    for sets in (given.observations, drifting))
    assert sure.correlation_time == 1.0 and unsure.correlation_time > 2.0


def test_jittering_stamps_make_the_time_less_sure():
    given, rng = scene(20, 200, noise_m=0.001, noise_rad=0.001), np.random.default_rng(4)
    stamps = given.observations.stamps + rng.normal(scale=5e6, size=200).astype(np.int64)
    sets = Observations('camera', stamps, given.observations.seen, 'map')
    [steady], [jittering] = (
        calibrate(given.buffer, EDGE, each, time=True, limits=NEAR).time_offsets
        for each in (given.observations, sets))
    assert steady.jitter_s == 0.0 and 0.004 < jittering.jitter_s < 0.006
    assert jittering.sigma_s > 2.0 * steady.sigma_s
    assert abs(jittering.offset_s - 0.08) < 4.0 * jittering.sigma_s


# --- kinds of observations

def test_points_with_a_known_place_are_enough():
    given = scene(11, 150, points=True, turned_deg=2.0, moved_m=0.02)
    sets = Observations('camera', given.observations.stamps, given.observations.seen, 'map',
                        place=PLACE[:3])
    found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
    assert found.verdict is Verdict.BOTH and not found.unobservable
    assert_near(found.edge, given.true)


def test_camera_in_the_room_sees_a_marker_on_the_hand():
    """Eye to hand: the target is fixed to a moving frame, and the edge is traversed upwards."""
    given = scene(12, 120, offset_s=0.03)
    given.buffer.insert('map', 'eye', 0, PLACE, static=True)
    sets = Observations('eye', given.observations.stamps,
                        se3.inverse_many(given.observations.seen), 'camera', place=Pose())
    found = calibrate(given.buffer, EDGE, sets, time=True, limits=NEAR)
    assert_near(found.edge, given.true)
    assert found.verdict is Verdict.BOTH


def test_two_edges_two_sensors_and_two_targets_at_once():
    first, second = scene(13, 100, offset_s=0.03), scene(13, 100, offset_s=0.03)
    tree = first.buffer
    tree.insert('base', 'mast', 0, Pose.from_xyz_rpy(x=-0.1, z=0.3, yaw=0.2), static=True)
    tree.insert('mast', 'lidar', 0, (Pose.from_xyz_rpy(x=-0.1, z=0.3, yaw=0.2).inverse()
                                     @ tree.lookup('base', 'camera')), static=True)
    sets = [first.observations, Observations(
        'lidar', second.observations.stamps, second.observations.seen, 'map', 'other')]
    found = calibrate(tree, [EDGE, ('mast', 'lidar')], sets, time=True, limits=NEAR)
    assert_near(found.edges[0], first.true)
    assert_near(found.edges[1], Pose.from_xyz_rpy(x=-0.1, z=0.3, yaw=0.2).inverse() @ first.true)
    assert [each.sensor for each in found.time_offsets] == ['camera', 'lidar']
    assert set(found.places) == {('map', 'target'), ('map', 'other')}


def test_given_covariances_weigh_the_observations():
    given = scene(14, 120, offset_s=0.0, noise_m=0.0005, noise_rad=0.0005)
    rng = np.random.default_rng(3)
    seen, bad = given.observations.seen.copy(), np.arange(120) % 2 == 0
    seen[bad, :3] += 0.05 * rng.normal(size=(60, 3))
    covariances = np.tile(np.diag([2.5e-7] * 6), (120, 1, 1))
    covariances[bad, :3, :3] += 0.05 ** 2 * np.eye(3)
    weighted, equal = (calibrate(given.buffer, EDGE, Observations(
        'camera', given.observations.stamps, seen, 'map', covariances=each), limits=NEAR)
        for each in (covariances, None))
    assert_near(weighted.edge, given.true)
    assert np.trace(weighted.edge.covariance[:3, :3]) < np.trace(equal.edge.covariance[:3, :3])


def test_detector_without_some_axes_does_no_harm():
    given = scene(19, 80, offset_s=0.0)
    flat = np.diag([4e-6, 4e-6, 4e-6, 0.0, 0.0, 4e-6])      # zero: unknown to the driver
    sets = [Observations('camera', given.observations.stamps, given.observations.seen, 'map',
                         covariances=flat),
            Observations('camera', at([500.0, 501.0]), [PLACE] * 2, 'map', 'too late')]
    found = calibrate(given.buffer, EDGE, sets, limits=NEAR)
    assert found.observations == 80 and found.verdict is Verdict.EDGE


def test_covariances_of_the_tree_make_it_less_sure():
    given = scene(15, 100, offset_s=0.0)
    stamps = given.buffer.stamps_of('base')
    unsure = BufferCore(cache_time=UNLIMITED)
    unsure.insert_track('map', 'base', stamps, given.buffer.lookup_many('map', 'base', stamps))
    unsure.insert(*EDGE, 0, given.buffer.lookup(*EDGE), static=True)
    unsure.insert('room', 'map', 0, Pose(), static=True,
                  covariance=np.diag([4e-4] * 3 + [1e-4] * 3))
    sets = Observations('camera', given.observations.stamps, given.observations.seen, 'room',
                        covariances=np.diag([4e-6] * 6))
    found = calibrate(unsure, EDGE, sets, limits=NEAR)
    assert_near(found.edge, given.true)


def test_covariance_goes_on_into_the_tree():
    given = scene(16, 100, offset_s=0.0)
    found = calibrate(given.buffer, EDGE, given.observations, limits=NEAR).edge
    given.buffer.insert(found.parent, found.child, 0, found.after, static=True,
                        covariance=found.covariance, strict=True)
    [share] = given.buffer.lookup_budget('map', 'camera', int(at(3.0)))
    assert (share.parent, share.child) == EDGE


def test_result_is_plain_data():
    given = scene(17, 60)
    found = calibrate(given.buffer, EDGE, given.observations, time=True, limits=NEAR).as_dict()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert {'edge', 'time_offset_s', 'time_offset_sigma_s', 'verdict', 'explanations',
            'unobservable', 'outliers', 'observations'} <= set(found)
    assert set(found['edge']) == {'parent', 'child', 'before', 'after', 'covariance'}
    assert list(found['edge']['after']) == ['x', 'y', 'z', 'qx', 'qy', 'qz', 'qw']


def test_short_stops_without_transforms_between_them_can_be_used():
    """Ten poses of an arm, each with one transform: a time offset cannot be estimated."""
    given = scene(18, 200, offset_s=0.0)
    stops = given.observations.stamps[::20]
    few = BufferCore(cache_time=UNLIMITED)
    few.insert_track('map', 'base', stops, given.buffer.lookup_many('map', 'base', stops))
    few.insert(*EDGE, 0, given.buffer.lookup(*EDGE), static=True)
    sets = Observations('camera', stops, given.observations.seen[::20], 'map')
    found = calibrate(few, EDGE, sets)
    assert found.observations == 10
    assert np.abs(errors(found.edge.after, given.true)).max() < 0.02


# --- bad input

@pytest.fixture(scope='module')
def given():
    return scene(0, 20, duration_s=4.0)


@pytest.mark.parametrize('edge, change, sentence', [
    (('map', 'base'), {}, 'the edge map -> base moves, and only a static one'),
    (('base', 'lidar'), {}, 'the tree has no edge base -> lidar; its static ones are: '
                            'base -> camera'),
    (('camera', 'base'), {}, 'but base -> camera: name the parent first'),
    (EDGE, {'sensor': 'kamera'}, "the observations are in 'kamera', which is not in the tree; "
                                 'it has: base, map, camera'),
    (EDGE, {'fixed_in': 'world'}, "the target rests in 'world', which is not in the tree"),
    (EDGE, {'sensor': 'base'}, 'the edge base -> camera does not lie between'),
    (EDGE, {'stamps': [], 'seen': np.zeros((0, 7))}, "'target' was never seen"),
    (EDGE, {'stamps': [int(at(1))], 'seen': [PLACE]}, '1 observations are too few'),
    (EDGE, {'stamps': at([100, 101, 102, 103]), 'seen': [PLACE] * 4},
     'the tree has transforms for 0 of 4 observations')])
def test_what_cannot_be_estimated_is_one_sentence(given, edge, change, sentence):
    words = {'sensor': 'camera', 'stamps': given.observations.stamps,
             'seen': given.observations.seen, 'fixed_in': 'map', **change}
    with pytest.raises(CalibrationError) as raised:
        calibrate(given.buffer, edge, Observations(**words))
    assert sentence in str(raised.value) and '\n' not in str(raised.value)


@pytest.mark.parametrize('change, sentence', [
    ({'stamps': [1.5, 2.5]}, 'integer nanoseconds'),
    ({'seen': np.zeros((2, 4))}, '2 stamps need as many poses'),
    ({'seen': [(0, 0, 0, 0, 0, 0, 2.0)] * 2}, 'does not have the length 1'),
    ({'seen': 'poses'}, 'must be an array of numbers'),
    ({'covariances': np.eye(3)}, r'\(6, 6\) or \(N, 6, 6\)'),
    ({'covariances': np.eye(6) - 0.5}, 'is not positive semidefinite'),
    ({'place': (1.0, 2.0, 3.0)}, "the place of 'target' has the shape")])
def test_observations_are_checked(change, sentence):
    words = {'sensor': 'camera', 'stamps': [1, 2], 'seen': [PLACE] * 2, 'fixed_in': 'map'}
    with pytest.raises(CalibrationError, match=sentence):
        Observations(**{**words, **change})


def test_what_is_not_finite_is_left_out():
    seen = np.array([PLACE] * 3)
    seen[1, 2] = np.nan
    assert Observations('camera', [3, 2, 1], seen, 'map').stamps.tolist() == [1, 3]


def test_same_evidence_sent_again_is_no_new_evidence():
    sets = Observations('camera', [2, 1, 2, 2], [PLACE, PLACE, PLACE, Pose()], 'map')
    assert sets.stamps.tolist() == [1, 2, 2] and len({tuple(each) for each in sets.seen}) == 2
