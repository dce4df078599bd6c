# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""An edge that moves along any function of time; test_edges tests the common properties."""

import os
from pathlib import Path
import pickle
import re
import subprocess
import sys
from types import SimpleNamespace

from hypothesis import given, strategies as st
import numpy as np
from programs import PATIENCE_S
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, ConstantTwist, load, lookup_twist, screws, Spline
from tf_tree_py.beyond.curves.curve import GivenCurve
from tf_tree_py.beyond.uncertainty.insertion import insert_covariance
from tf_tree_py.core import (
    FutureExtrapolationException,
    InvalidArgumentException,
    Kind,
    LookupException,
    Pose,
    TreeFileError,
)
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.stamp import FOREVER, LATEST

SECOND = 10**9
BEGIN, END = SECOND, 3 * SECOND
TILT = Pose.from_xyz_rpy(0.3, -0.2, 0.1, 0.5, -1.0, 2.0)


class Orbit:
    """A body that orbits its parent and faces it, as a user may write it, in ten lines."""

    oldest, latest = BEGIN, END

    def poses(self, stamps):
        angle = stamps * 2e-9
        nothing = np.zeros(len(stamps))
        return np.stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), nothing, nothing, nothing,
                         np.sin(0.5 * angle), np.cos(0.5 * angle)], axis=1)


class KnownOrbit(Orbit):

    def twists(self, stamps):
        return np.tile([0.0, 6.0, 0.0, 0.0, 0.0, 2.0], (len(stamps), 1))

    def saved_as(self):
        first = Pose._make(self.poses(np.array([self.oldest]))[0].tolist())
        return ConstantTwist(self.oldest, self.latest, first, (0.0, 6.0, 0.0, 0.0, 0.0, 2.0))


def pose_of(curve, stamp):
    return Pose._make(np.asarray(curve.poses(np.array([stamp])))[0].tolist())


@pytest.fixture(params=[Orbit, KnownOrbit])
def curve(request):
    return request.param()


@pytest.fixture
def buffer(curve):
    """Return map -> odom, samples; odom -> base, a curve; base -> camera, static."""
    buffer = BufferCore()
    stamps = np.arange(BEGIN, END + 1, SECOND // 10)
    buffer.insert_track('map', 'odom', stamps, [
        Pose.from_xyz_rpy(x=stamp * 1e-9, yaw=stamp * 3e-10) for stamp in stamps.tolist()])
    assert buffer.insert_curve('/odom', 'base', curve, authority='me') == []
    buffer.insert('base', 'camera', 0, TILT, static=True)
    return buffer


def test_lookup_is_the_function_among_the_other_edges(buffer, curve):
    stamp = 1_234_567_891
    expected = pose_of(curve, stamp) @ TILT
    assert_same_pose(buffer.lookup('odom', 'camera', stamp), expected)
    assert_same_pose(buffer.lookup('camera', 'odom', stamp), expected.inverse())
    assert_same_pose(buffer.lookup_tree('odom', stamp)['camera'], expected)
    assert_same_pose(buffer.lookup('map', 'camera', stamp),
                     buffer.lookup('map', 'odom', stamp) @ expected)
    assert buffer.latest_common_time('map', 'camera') == END
    assert_same_pose(buffer.lookup('odom', 'base'), pose_of(curve, END))
    with pytest.raises(FutureExtrapolationException, match='a curve that ends earlier'):
        buffer.lookup('odom', 'base', END + 1)
    assert [edge.authority for edge in buffer.edges() if edge.child == 'base'] == ['me']


@pytest.mark.parametrize('count', [1, 50, 30_000])
def test_many_stamps_are_answered_as_one_by_one(buffer, count):
    stamps = np.random.default_rng(1).integers(BEGIN, END, count, endpoint=True)
    before = stamps.copy()
    for target, source in (('map', 'camera'), ('camera', 'odom')):
        poses = buffer.lookup_many(target, source, stamps)
        for number in range(0, count, max(count // 50, 1)):
            assert_same_pose(poses[number],
                             buffer.lookup(target, source, int(stamps[number])), reach=10.0)
    assert (stamps == before).all()


def test_twist_is_the_curves_own_or_of_its_poses(buffer):
    found = lookup_twist(buffer, 'base', 'odom', 2 * SECOND, SECOND // 1000,
                         reference_frame='base')
    assert found.linear == pytest.approx((0.0, 6.0, 0.0), abs=1e-4)
    assert found.angular == pytest.approx((0.0, 0.0, 2.0), abs=1e-6)


def test_twists_of_a_curve_are_taken_whatever_the_interval():
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', KnownOrbit())
    found = lookup_twist(buffer, 'base', 'odom', 2 * SECOND, 2 * SECOND, reference_frame='base')
    assert found.linear == pytest.approx((0.0, 6.0, 0.0), abs=1e-12)


def test_snapshot_answers_alike_after_the_curve_was_replaced(buffer, curve):
    stamp = 2 * SECOND
    still = buffer.snapshot()
    version = buffer.intake.tree.version
    buffer.insert_curve('odom', 'base', ConstantTwist(BEGIN, END, TILT, np.zeros(6)))
    assert buffer.intake.tree.version == version
    assert_same_pose(buffer.lookup('odom', 'base', stamp), TILT)
    assert_same_pose(still.lookup('odom', 'base', stamp), pose_of(curve, stamp))


def test_files_and_pickles_have_what_stands_for_the_curve(tmp_path):
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', KnownOrbit())
    buffer.insert_curve('odom', 'cart', ConstantTwist(BEGIN, END, TILT, (1, 2, 3, 0.1, 0.2, 0.3)))
    buffer.save(tmp_path / 'curves.tftree')
    for again in (load(tmp_path / 'curves.tftree'), pickle.loads(pickle.dumps(buffer.snapshot()))):
        for stamp in (BEGIN, 1_777_777_777, END):
            for frame in ('base', 'cart'):
                assert_same_pose(again.lookup('odom', frame, stamp),
                                 buffer.lookup('odom', frame, stamp))
        assert again.edges() == buffer.edges()
        twist = lookup_twist(again, 'cart', 'odom', END, SECOND, reference_frame='cart')
        assert (*twist.linear, *twist.angular) == pytest.approx((1, 2, 3, 0.1, 0.2, 0.3))


@pytest.mark.parametrize('saved_as', [
    None, lambda: None, lambda: SimpleNamespace(oldest=BEGIN, latest=END, poses=Orbit().poses)])
def test_what_files_do_not_have_says_what_to_do(tmp_path, saved_as):
    curve = SimpleNamespace(oldest=BEGIN, latest=END, poses=Orbit().poses)
    if saved_as is not None:
        curve.saved_as = saved_as
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', curve)
    for write in (lambda: buffer.save(tmp_path / 'no.tftree'),
                  lambda: pickle.dumps(buffer.snapshot())):
        with pytest.raises(TreeFileError, match=r"above 'base' cannot be saved.*saved_as\(\)"):
            write()
    assert not list(tmp_path.iterdir())


# --- a constant twist

axes = st.floats(-3.0, 3.0)


@given(start=st.tuples(*[axes] * 6), twist=st.tuples(*[axes] * 6),
       stamps=st.lists(st.integers(BEGIN, END), min_size=1, max_size=5))
def test_constant_twist_goes_along_one_screw(start, twist, stamps):
    first = screws.exp(start)
    curve = ConstantTwist(BEGIN, END, first, twist)
    for stamp, pose in zip(stamps, curve.poses(np.array(stamps)), strict=True):
        since = (stamp - BEGIN) * 1e-9
        step = screws.exp(tuple(since * value for value in twist))
        assert_same_pose(pose, se3.compose(first, step), reach=20.0)
    assert curve.twists(np.array(stamps)).tolist() == [list(twist)] * len(stamps)


def test_numbers_of_a_constant_twist_are_checked():
    for oldest, pose, twist, why in (
            (0.5, TILT, np.zeros(6), 'stamp'), (0, 'here', np.zeros(6), 'pose'),
            (0, TILT, np.zeros(5), 'six finite numbers'), (0, TILT, 'fast', 'six finite'),
            (0, TILT, [np.nan] * 6, 'six finite')):
        with pytest.raises(InvalidArgumentException, match=why):
            ConstantTwist(oldest, END, pose, twist)


# --- wrong input is refused, or reported


def namespace(**changed):
    return SimpleNamespace(**{'oldest': BEGIN, 'latest': END, 'poses': Orbit().poses, **changed})


@pytest.mark.parametrize(('changed', 'why'), [
    ({'oldest': None}, 'oldest or latest'), ({'latest': 2.5}, 'oldest or latest'),
    ({'oldest': END + 1}, 'not be earlier than oldest'), ({'oldest': -2**63}, 'not be earlier'),
    ({'latest': FOREVER}, '64 bits'),
    ({'poses': lambda stamps: np.zeros((3, 7))}, 'not a rotation|3 poses for 2 stamps'),
    ({'poses': lambda stamps: np.ones((1, 7))}, '1 poses for 2 stamps'),
    ({'poses': lambda stamps: np.ones((len(stamps), 6))}, 'rows? of poses'),
    ({'poses': lambda stamps: np.zeros((len(stamps), 7))}, 'not a rotation'),
    ({'poses': lambda stamps: np.full((len(stamps), 7), np.inf)}, 'not finite'),
    ({'poses': lambda stamps: 1 / 0}, 'raised ZeroDivisionError'),
    ({'poses': 7}, 'raised TypeError'),
    ({'twists': lambda stamps: np.zeros((len(stamps), 3))}, r'\(2, 6\) finite numbers'),
    ({'twists': lambda stamps: 'fast'}, 'must return numbers'),
])
def test_what_is_no_curve_is_refused_when_it_is_inserted(changed, why):
    buffer = BufferCore()
    with pytest.raises(InvalidArgumentException, match=why) as caught:
        buffer.insert_curve('odom', 'base', namespace(**changed))
    assert 'odom -> base' in str(caught.value)
    assert not buffer.frames()


@pytest.mark.parametrize('given_', [None, Orbit, Pose(), 'curve', lambda stamps: stamps])
def test_what_cannot_be_a_curve_says_what_one_is(given_):
    with pytest.raises(InvalidArgumentException, match=r'a curve needs oldest and latest'):
        BufferCore().insert_curve('odom', 'base', given_)


def test_function_that_fails_later_fails_the_lookup_and_nothing_else():
    def poses(stamps):
        if (stamps == 2 * SECOND).any():
            raise RuntimeError('no solution')
        return Orbit().poses(stamps)

    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', namespace(poses=poses))
    for lookup in (lambda: buffer.lookup('odom', 'base', 2 * SECOND),
                   lambda: buffer.lookup_within(60.0, 'odom', 'base', 2 * SECOND),
                   lambda: buffer.lookup_many('odom', 'base', [BEGIN, 2 * SECOND])):
        with pytest.raises(InvalidArgumentException, match='RuntimeError: no solution') as caught:
            lookup()
        assert isinstance(caught.value.__cause__, RuntimeError)
    assert buffer.lookup('odom', 'base', BEGIN)


def test_function_that_computes_in_place_harms_no_caller():
    def poses(stamps):
        stamps -= BEGIN
        return Orbit().poses(stamps)

    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', namespace(poses=poses))
    stamps = np.arange(BEGIN, END, SECOND)
    buffer.lookup_many('odom', 'base', stamps)
    assert stamps.tolist() == [BEGIN, 2 * SECOND]


def test_quaternions_are_normalised_and_other_forms_of_poses_are_taken():
    long = namespace(poses=lambda stamps: Orbit().poses(stamps) * ([1.0] * 3 + [-3.0] * 4))
    matrices = namespace(poses=lambda stamps: se3.as_matrix_many(Orbit().poses(stamps)))
    for curve in (long, matrices):
        buffer = BufferCore()
        buffer.insert_curve('odom', 'base', curve)
        found = buffer.lookup('odom', 'base', 2 * SECOND)
        assert_same_pose(found, pose_of(Orbit(), 2 * SECOND))
        assert np.linalg.norm(found.rotation) == pytest.approx(1.0, abs=1e-15)


def test_curve_may_know_the_future_and_one_that_begins_there_is_refused():
    buffer = BufferCore(now=lambda: 2 * SECOND, max_future=SECOND // 10)
    assert buffer.insert_curve('odom', 'base', Orbit(), strict=False) == []
    assert buffer.lookup('odom', 'base', END)
    late = namespace(oldest=END - 1)
    incident, = buffer.insert_curve('odom', 'cart', late, strict=False)
    assert incident.kind is Kind.FAR_FUTURE


def test_curve_of_one_stamp_is_known_there():
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', namespace(latest=BEGIN))
    assert_same_pose(buffer.lookup('odom', 'base'), pose_of(Orbit(), BEGIN))
    assert buffer.stamps_of('base').tolist() == [BEGIN]


def test_stamps_of_a_curve_show_it_and_are_not_too_many():
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', namespace(latest=BEGIN + 25_000_000))
    assert (buffer.stamps_of('base') - BEGIN).tolist() == [0, 10**7, 2 * 10**7, 25_000_000]
    assert [stamp - BEGIN for stamp, _ in buffer.samples_around('base', BEGIN + 11_000_000)] == [
        10**7, 2 * 10**7]
    buffer.insert_curve('odom', 'moon', namespace(oldest=0, latest=2**62))
    assert 50_000 < len(buffer.stamps_of('moon')) <= 100_001
    for edge in buffer.edges():
        assert edge.samples == len(buffer.stamps_of(edge.child))
    assert_same_pose(buffer.lookup('odom', 'moon', 2 * SECOND), pose_of(Orbit(), 2 * SECOND))


def test_uncertainty_and_prediction_work_on_any_curve():
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', ConstantTwist(BEGIN, END, TILT, (1, 0, 0, 0, 0, 0.5)))
    insert_covariance(buffer.intake, 'odom', 'base', BEGIN, np.eye(6) * 1e-4, 'me')
    _, covariance = buffer.lookup_uncertain('odom', 'base', 2 * SECOND)
    assert covariance == pytest.approx(np.eye(6) * 1e-4)
    ahead = buffer.predict('odom', 'base', END + SECOND // 10, SECOND)
    step = screws.exp((0.1, 0, 0, 0, 0, 0.05))
    assert_same_pose(ahead.pose, buffer.lookup('odom', 'base', END) @ Pose._make(step),
                     tolerance=1e-9)


def test_example_of_a_motion_model_is_closer_than_lines():
    example = Path(__file__).parents[3] / 'examples' / 'motion_model.py'
    done = subprocess.run([sys.executable, str(example)], capture_output=True, text=True,
                          check=True, timeout=PATIENCE_S, env={
                              **os.environ, 'PYTHONPATH': str(example.parents[1])})
    of_lines, of_process = re.search(r'interpolation ([\d.]+) mm, of the process ([\d.]+)',
                                     done.stdout).groups()
    assert float(of_process) < 0.7 * float(of_lines)


class Counted(GivenCurve):
    """It counts how often it is asked for its length, which a curve may have to compute."""

    asked = 0

    def __len__(self):
        self.asked += 1
        return super().__len__()


def test_lookups_never_ask_a_curve_for_its_length():
    curve, stamps = Counted(Orbit(), 'odom -> base'), [BEGIN, END]
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', curve)
    buffer.insert('base', 'camera', 0, TILT, static=True)
    buffer.insert('camera', 'lens', 0, TILT, static=True)
    for tree in (buffer, buffer.snapshot()):
        for source in ('base', 'lens'):
            for stamp in (LATEST, 2 * SECOND):
                tree.lookup('odom', source, stamp)
                tree.lookup_tree(source, stamp)
                tree.lookup_uncertain('odom', source, stamp)
            tree.latest_common_time('odom', source)
            tree.lookup_many('odom', source, stamps)
            tree.lookup_full(source, BEGIN, 'camera', END, 'odom')
            with pytest.raises(FutureExtrapolationException):
                tree.lookup('odom', source, END + 1)
            with pytest.raises(LookupException):
                tree.lookup('nowhere', source)
    assert curve.asked == 0
    assert len(buffer.intake.tree.histories['base']) == len(curve)
    assert curve.asked == 2


def test_spline_is_a_curve_and_needs_no_wrapping():
    stamps = np.arange(BEGIN, END, SECOND // 50)
    spline = Spline.fit(stamps, Orbit().poses(stamps), 10.0)
    buffer = BufferCore()
    buffer.insert_curve('odom', 'base', spline)
    assert buffer.intake.tree.histories['base'].curve is spline
    assert so3.log(so3.multiply(so3.conjugate(spline.pose(2 * SECOND)[3:]),
                                pose_of(Orbit(), 2 * SECOND)[3:])) == pytest.approx(
        (0, 0, 0), abs=1e-6)
