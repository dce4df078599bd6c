# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""An edge of a tree that is a spline: inserted, looked up, waited for, replaced."""

import math
import pickle
import threading

import numpy as np
from programs import PATIENCE_S
import pytest
from strategies import assert_same_pose, waving_poses
from tf_tree_py import BufferCore, lookup_twist, lookup_twist_many, screws, Spline, SplineFitter
from tf_tree_py.beyond.curves.spline import SplineTrack
from tf_tree_py.core import (
    FutureExtrapolationException,
    InvalidArgumentException,
    Kind,
    NoDataException,
    PastExtrapolationException,
    Pose,
    RefusedException,
    TransformWarning,
)
from tf_tree_py.core.geometry import se3

SECOND = 1_000_000_000
PERIOD = 5_000_000
STAMPS = SECOND + np.arange(201) * PERIOD
TURNED = Pose.from_xyz_rpy(0.3, -0.2, 0.1, 0.5, -1.0, 2.0)


def wave(stamps):
    return waving_poses(np.asarray(stamps) * 1e-9)


@pytest.fixture(scope='module')
def spline():
    return Spline.fit(STAMPS, wave(STAMPS), 50.0)


@pytest.fixture
def buffer(spline):
    """Return map -> odom, by samples; odom -> imu, a spline; imu -> camera, static."""
    buffer = BufferCore()
    buffer.insert_track('map', 'odom', STAMPS[::10], wave(STAMPS[::10] + SECOND))
    assert buffer.insert_curve('/odom', 'imu', spline, authority='fit') == []
    buffer.insert('imu', 'camera', 0, TURNED, static=True)
    return buffer


def test_lookup_is_the_spline_among_the_other_edges(buffer, spline):
    stamp = 1_234_567_891
    odom_T_camera = spline.pose(stamp) @ TURNED
    assert_same_pose(buffer.lookup('odom', 'camera', stamp), odom_T_camera)
    assert_same_pose(buffer.lookup('camera', 'odom', stamp), odom_T_camera.inverse())
    assert_same_pose(buffer.lookup('map', 'camera', stamp),
                     buffer.lookup('map', 'odom', stamp) @ odom_T_camera)
    assert_same_pose(buffer.lookup_tree('odom', stamp)['camera'], odom_T_camera)
    assert buffer.latest_common_time('odom', 'camera') == spline.latest
    assert_same_pose(buffer.lookup('odom', 'imu'), spline.pose(spline.latest))
    assert [edge.samples for edge in buffer.edges()] == [21, len(spline), 1]


@pytest.mark.parametrize('count', [50, 100_000])
@pytest.mark.parametrize('on_se3', [False, True])
def test_many_stamps_are_answered_as_one_by_one(buffer, count, on_se3):
    buffer.insert_curve('odom', 'imu', Spline.fit(STAMPS, wave(STAMPS), 50.0, on_se3=on_se3))
    stamps = np.random.default_rng(1).integers(STAMPS[0], STAMPS[-1], count, endpoint=True)
    for target, source in (('map', 'camera'), ('camera', 'odom')):
        poses = buffer.lookup_many(target, source, stamps)
        for number in range(0, count, count // 50):
            assert_same_pose(
                poses[number], buffer.lookup(target, source, int(stamps[number])), reach=10.0,
                tolerance=2e-13)


def test_polynomials_are_the_spline_also_where_it_is_far_away_and_fast():
    rng = np.random.default_rng(2)
    for turn, way in ((1e-3, 1.0), (0.1, 0.1), (0.5, 10.0), (1.5, 3.0)):
        knots = [se3.IDENTITY]
        for _ in range(14):
            step = *(way * rng.normal(size=3)), *(turn * rng.normal(size=3))
            knots.append(se3.compose(knots[-1], screws.exp(step)))
        spline = Spline(0, 10_000_000, np.array(knots), 120_000_000)
        buffer = BufferCore()
        buffer.insert_curve('map', 'far', spline)
        buffer.insert('map', 'tower', 0, Pose.from_xyz_rpy(50.0, yaw=1.0), static=True)
        buffer.insert('far', 'tip', 0, Pose.from_xyz_rpy(5.0, pitch=1.0), static=True)
        stamps = rng.integers(0, 120_000_000, 40_000, endpoint=True)
        many = buffer.lookup_many('tower', 'tip', stamps)
        tower_T_map = buffer.lookup_at('tower', 'map', 5)
        exact = se3.compose_many(
            se3.compose_many(np.array(tower_T_map), spline.poses(stamps)),
            np.array(buffer.lookup_at('far', 'tip', 5)))
        moved, turned = se3.distance_many(exact, many)
        assert moved.max() < 2e-12 and turned.max() < 2e-12, (turn, way)


def test_stamps_may_be_none_or_all_outside(buffer):
    assert buffer.lookup_many('map', 'camera', []).shape == (0, 7)
    assert lookup_twist_many(buffer, 'imu', 'odom', [], PERIOD).shape == (0, 6)
    outside = [-SECOND, 0, 10 * SECOND]
    poses, valid = buffer.lookup_many('map', 'camera', outside, outside='mask')
    assert not valid.any() and np.isnan(poses).all()


@pytest.mark.parametrize('turn', [0.3, 0.5, 1.0, 2.0])
def test_motion_bounds_what_a_polynomial_deviates(turn):
    rng = np.random.default_rng(3)
    knots = [se3.IDENTITY]
    for number in range(10):
        axis = rng.normal(size=3)
        step = *(0.5 * rng.normal(size=3)), *(turn * (-1) ** number * axis / np.linalg.norm(axis))
        knots.append(se3.compose(knots[-1], screws.exp(step)))
    track = SplineTrack(Spline(0, 10_000, np.array(knots), 80_000), 0, 80_000)
    pieces = np.arange(9) * 10_000
    angle, distance = track.motion(pieces)
    asked = np.linspace(0.0, 1.0, 50)
    for nodes in range(3, 8):
        places = 0.5 - 0.5 * np.cos(np.pi * np.arange(nodes) / (nodes - 1))
        values = track.at(pieces[:-1, None], 10_000 * places)
        matrix = np.vander(asked, nodes) @ np.linalg.inv(np.vander(places))
        error = np.abs(values @ matrix.T - track.at(pieces[:-1, None], 10_000 * asked))
        scale = 2.0 / (4.0 ** nodes * math.factorial(nodes))
        assert error[3:].max() < scale * angle ** nodes
        assert error[:3].max() < scale * nodes * distance * angle ** (nodes - 1)


def test_twist_of_a_spline_is_its_own_and_not_an_average(buffer, spline):
    stamp = 1_500_000_001
    pose = spline.pose(stamp)
    expected = screws.carry((0.0, 0.0, 0.0, *pose.rotation), spline.twist(stamp))
    found = lookup_twist(buffer, 'imu', 'odom', stamp, 500_000_000)
    assert (*found.linear, *found.angular) == pytest.approx(expected, abs=1e-12)
    # The inverse: the parent as seen from the child, in the child's axes.
    back = lookup_twist(buffer, 'odom', 'imu', stamp, 500_000_000)
    assert back.angular == pytest.approx([-value for value in spline.twist(stamp)[3:]])
    for tracked, observer in (('imu', 'odom'), ('odom', 'imu'), ('camera', 'map')):
        asked = STAMPS[20:180:7] + 1
        many = lookup_twist_many(buffer, tracked, observer, asked, 40_000_000)
        for at, twist in zip(asked.tolist(), many, strict=True):
            one = lookup_twist(buffer, tracked, observer, at, 40_000_000)
            assert (*one.linear, *one.angular) == pytest.approx(twist, abs=1e-9)


def test_error_outside_the_spline_says_what_the_edge_is(buffer, spline):
    with pytest.raises(PastExtrapolationException, match='a curve that begins later') as past:
        buffer.lookup('odom', 'camera', spline.oldest - 1)
    with pytest.raises(FutureExtrapolationException, match='a curve that ends') as future:
        buffer.lookup('odom', 'camera', spline.latest + 1)
    assert (past.value.oldest, future.value.latest) == (spline.oldest, spline.latest)
    assert past.value.blocked_on is None and future.value.blocked_on is not None
    live = BufferCore(now=lambda: SECOND)
    live.insert_curve('odom', 'imu', spline)
    with pytest.raises(FutureExtrapolationException, match='wait for a longer one'):
        live.lookup('odom', 'imu', spline.latest + 1)


def test_waiting_ends_when_the_spline_has_grown(buffer):
    fitter, more = SplineFitter(50.0), STAMPS + STAMPS[-1] - STAMPS[0]
    buffer.insert_curve('odom', 'imu', fitter.add(STAMPS, wave(STAMPS)))
    found = []
    waiter = threading.Thread(target=lambda: found.append(
        buffer.lookup_within(60.0, 'odom', 'imu', int(more[100]))))
    waiter.start()
    assert buffer.waiting.sleep_until_somebody(PATIENCE_S)
    buffer.insert_curve('odom', 'imu', fitter.add(more[:50], wave(more[:50])))
    assert len(buffer.waiting) == 1
    buffer.insert_curve('odom', 'imu', fitter.add(more[50:], wave(more[50:])))
    assert len(buffer.waiting) == 0
    waiter.join()
    assert_same_pose(found[0], wave(more[100:101])[0], tolerance=1e-4)


def test_spline_that_goes_on_leaves_paths_as_they_are(buffer, spline):
    buffer.lookup('map', 'camera', 1_500_000_000)
    version = buffer.intake.tree.version
    assert buffer.insert_curve('odom', 'imu', spline) == []
    assert buffer.intake.tree.version == version
    longer = Spline.fit(STAMPS, wave(STAMPS + SECOND), 20.0)
    buffer.insert_curve('odom', 'imu', longer)
    assert buffer.lookup('odom', 'imu', 1_500_000_000) == longer.pose(1_500_000_000)
    still = buffer.snapshot()
    buffer.insert_curve('odom', 'imu', spline)
    for snapshot in (still, pickle.loads(pickle.dumps(still))):
        assert snapshot.lookup('odom', 'imu', 1_500_000_000) == longer.pose(1_500_000_000)


def test_edge_changes_its_kind_and_that_is_told(buffer, spline):
    incident, = buffer.insert('odom', 'imu', 3 * SECOND, Pose(), strict=False)
    assert incident.kind is Kind.KIND_CHANGE
    assert "it was a curve from 'fit' and is now dynamic" in str(incident)
    assert buffer.lookup('odom', 'imu') == Pose()
    incident, = buffer.insert_curve('odom', 'imu', spline, strict=False)
    assert 'is now a curve' in str(incident)
    assert [incident.kind for incident in buffer.insert_track(
        'odom', 'imu', STAMPS, wave(STAMPS), strict=False)] == [Kind.KIND_CHANGE]
    with pytest.warns(TransformWarning, match='is now a curve'):
        buffer.insert_curve('odom', 'imu', spline)


@pytest.mark.parametrize(('parent', 'child', 'kind'), [
    ('camera', 'odom', Kind.LOOP), ('imu', 'imu', Kind.SELF_EDGE), ('', 'imu', Kind.EMPTY_FRAME),
    ('odom', 'x' * 5000, Kind.BAD_NAME)])
def test_what_breaks_a_rule_is_refused(buffer, spline, parent, child, kind):
    before = buffer.edges(), buffer.frames()
    incident, = buffer.insert_curve(parent, child, spline, strict=False)
    assert incident.kind is kind and incident.refused
    with pytest.raises(RefusedException):
        buffer.insert_curve(parent, child, spline, strict=True)
    assert (buffer.edges(), buffer.frames()) == before
    assert buffer.statistics().incidents[kind] == 2


def test_spline_far_ahead_of_the_clock_is_refused(spline):
    buffer = BufferCore(now=lambda: SECOND // 2, max_future=SECOND // 10)
    incident, = buffer.insert_curve('odom', 'imu', spline, strict=False)
    assert incident.kind is Kind.FAR_FUTURE and not buffer.edges()


def test_cleared_buffer_forgets_it_and_takes_another(buffer, spline):
    buffer.clear()
    with pytest.raises(NoDataException):
        buffer.lookup('odom', 'imu', 1_500_000_000)
    assert buffer.insert_curve('odom', 'imu', spline) == []
    assert buffer.lookup('odom', 'imu', 1_500_000_000) == spline.pose(1_500_000_000)
    assert buffer.remove_frame('imu')


@pytest.mark.parametrize('given', [None, 'spline', STAMPS, Pose()])
def test_what_is_no_curve_is_refused(buffer, given):
    with pytest.raises(InvalidArgumentException, match='Spline.fit makes one'):
        buffer.insert_curve('odom', 'imu', given)
    with pytest.raises(InvalidArgumentException, match='parent is the name of a frame, not 7'):
        buffer.insert_curve(7, 'imu', Spline.fit([1], [Pose()], 1.0))
