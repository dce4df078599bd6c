# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The interface of histories to the tree, for every kind, including one from outside."""

import ast
import json
import math
from pathlib import Path

from hypothesis import example, given, strategies as st
import numpy as np
from policies import HoldNewest
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, ConstantTwist, core, Spline
from tf_tree_py.beyond.corrections.blend import BlendLimits
from tf_tree_py.beyond.corrections.corrected import with_corrections
from tf_tree_py.beyond.corrections.correction import Correction
from tf_tree_py.beyond.curves.aided import aided
from tf_tree_py.beyond.curves.curve import GivenCurve
from tf_tree_py.beyond.curves.insertion import CurveHistory
from tf_tree_py.core import ExtrapolationException, Pose, TreeFileError
from tf_tree_py.core.edges.interpolation import Interpolation, LINEAR
from tf_tree_py.core.edges.protocol import moves
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.stamp import BEGINNING, FOREVER
from tf_tree_py.files.edges import Arrays, HISTORIES, load_history, save_history, Saved

WINDOW = 40
HOLD = 7
STAMPS = st.integers(0, 60)


def pose_number(number):
    return (float(number), 0.5 * number, -float(number), *so3.from_rpy(0.0, 0.1, 0.01 * number))


# --- interpolations from outside


def eased(ratio):
    return ratio * ratio * (3.0 - 2.0 * ratio)


class Eased(Interpolation):
    """Accelerates after each sample, and decelerates before the next; it has no name in files."""

    def between(self, samples, index, stamp):
        begin, end = samples.stamps[index:index + 2]
        return se3.interpolate(
            samples.pose(index), samples.pose(index + 1), eased((stamp - begin) / (end - begin)))


class Step(Interpolation):
    """Each sample is valid until the next."""

    name = 'step of a test'

    def between(self, samples, index, stamp):
        return samples.pose(index)


def sampled(interpolation=LINEAR):
    return Samples('child', WINDOW, interpolation=interpolation)


def stepping():
    return sampled(Step())


def easing():
    return sampled(Eased())


def holding():
    return sampled(HoldNewest(HOLD))


def aided_by_a_gyroscope():
    """Return a history whose child rotated back and forth between its poses."""
    history, gyroscope = aided(None, 'child', WINDOW)
    stamps = np.arange(10, 50)
    rates = 1e8 * np.stack([np.sin(stamps), 0 * stamps, 0.1 + 0 * stamps], 1)
    gyroscope.insert_rates(stamps, rates, None, math.inf)
    return history


def aided_and_holding():
    history = aided_by_a_gyroscope()
    history.interpolate_by(history.interpolation.followed_by(HoldNewest(HOLD)))
    return history


def blending(history):
    """Return a history with an increasing correction of its samples, from 20 to 45."""
    correction = Correction()
    correction.begin_blend(
        Pose.from_xyz_rpy(x=3.0, y=-1.0, yaw=2.0), 20, pose_number(2), pose_number(2),
        (1.0, 0.0, 0.0), BlendLimits(25, math.inf, math.inf, 0.0), BEGINNING)
    return with_corrections(history, {'parent': correction})


def aided_over_steps():
    history = aided_by_a_gyroscope()
    history.interpolate_by(history.interpolation.followed_by(Step()))
    return history


def corrected():
    return blending(sampled())


def aided_and_corrected():
    return blending(aided_by_a_gyroscope())


def all_at_once():
    return blending(aided_and_holding())


def static():
    return StaticHistory('child', 'parent', pose_number(0))


# --- on a curve


def spline_over(stamps):
    begin, end, pieces = min(stamps), max(stamps), len(set(stamps))
    return Spline(begin, max(1, -((begin - end) // pieces)),
                  np.array([pose_number(number) for number in range(pieces + 3)]), end)


def function_over(stamps):
    return GivenCurve(ConstantTwist(min(stamps), max(stamps), pose_number(1),
                                    (2e8, 0.0, 1e8, 0.0, 1e7, 5e7)), 'parent -> child')


def on_a_spline():
    return CurveHistory('child', None, None)


def on_a_function():
    return CurveHistory('child', None, None)


CURVES = {on_a_spline: spline_over, on_a_function: function_over}


HOLDING = (holding, aided_and_holding, all_at_once)
BEGINNINGS = (static, sampled, stepping, easing, aided_by_a_gyroscope, aided_over_steps, corrected,
              aided_and_corrected, *HOLDING, *CURVES)
every_kind = pytest.mark.parametrize('begin', BEGINNINGS)


def history_of(begin, stamps, parents=('parent',)):
    history = begin()
    if begin in CURVES:
        history.parent, history.curve = 'parent', CURVES[begin](stamps)
        return history
    for number, stamp in enumerate(stamps):
        history.insert(stamp, parents[number % len(parents)], pose_number(number))
    return history


def pose_at(history, stamp):
    try:
        return history.sample(stamp)
    except ExtrapolationException:
        return None


some_stamps = st.lists(STAMPS, min_size=1, max_size=12)
some_parents = st.sampled_from([('parent',), ('table', 'gripper'), ('a', 'a', 'b')])


# --- every kind


@every_kind
@given(stamps=some_stamps, parents=some_parents, stamp=STAMPS)
def test_there_is_a_parent_where_there_is_a_pose(begin, stamps, parents, stamp):
    history = history_of(begin, stamps, parents)
    parent = history.parent_at(stamp)
    assert (pose_at(history, stamp) is None) == (parent is None)
    parents_then = [name for name, since, until in history.parents_between(BEGINNING, FOREVER)
                    if since <= stamp < until]
    if parent is not None:
        assert parents_then == [parent]
        assert parent in history.possible_parents(stamp)
        assert history.has_named(parent)


@every_kind
@given(stamps=some_stamps, asked=st.lists(STAMPS, min_size=1, max_size=9))
def test_track_answers_as_one_by_one(begin, stamps, asked):
    history = history_of(begin, stamps)
    asked = np.array([stamp for stamp in asked if pose_at(history, stamp)], dtype=np.int64)
    if len(asked):
        poses = history.track(int(asked.min()), int(asked.max())).at(asked)
        for stamp, pose in zip(asked, np.broadcast_to(poses.T, (len(asked), 7)), strict=True):
            assert_same_pose(pose, history.sample(int(stamp)), reach=20.0)


@every_kind
@given(stamps=st.lists(STAMPS, min_size=2, max_size=12, unique=True))
def test_next_knot_is_approached_from_below(begin, stamps):
    history = history_of(begin, sorted(stamps))
    track = history.track(history.oldest_stamp, history.latest_stamp)
    knots = track.knots
    if begin is not on_a_spline:
        assert len(knots) == (0 if history.is_static else len(history))
    limits = track.at(knots[:-1], np.diff(knots) - 1.0).T
    for stamp, limit in zip(knots[1:].tolist(), limits, strict=not history.is_static):
        assert_same_pose(limit, history.sample(stamp - 1), reach=20.0)


@every_kind
@given(stamps=some_stamps)
@example(stamps=[45, 46])  # the two lengths are rounded differently
def test_track_moves_no_more_than_it_says(begin, stamps):
    history = history_of(begin, sorted(stamps))
    track = history.track(history.oldest_stamp, history.latest_stamp)
    knots = np.unique(track.knots)
    if len(knots) < 2:
        return
    angle, distance = track.motion(knots)
    for first, last in zip(knots[:-1], knots[1:], strict=True):
        ends = np.array([first, first])
        a, b = track.at(ends, np.array([0.0, float(last - first)])).T
        assert np.linalg.norm(b[:3] - a[:3]) <= distance + 1e-9
        assert np.linalg.norm(so3.log(so3.multiply(so3.conjugate(a[3:]), b[3:]))) <= angle + 1e-6
        assert np.linalg.norm(a[:3]) <= track.reach * (1.0 + 1e-12)


@every_kind
def test_copy_is_one_of_its_own(begin):
    history = history_of(begin, [10, 20, 30])
    twin = history.copy()
    assert type(twin) is type(history)
    before = [pose_at(history, stamp) for stamp in range(50)]
    assert [pose_at(twin, stamp) for stamp in range(50)] == before
    twin.insert(25, 'parent', pose_number(9))
    twin.insert(40, 'other', pose_number(10))
    twin.authority = 'somebody'
    assert [pose_at(history, stamp) for stamp in range(50)] == before
    assert (history.authority, history.parent) == ('', 'parent')


@every_kind
@given(stamps=st.lists(STAMPS, max_size=12), parents=some_parents, ended=st.booleans())
def test_kind_is_saved_to_the_bit_or_says_that_it_cannot_be(
        begin, stamps, parents, ended):
    history = history_of(begin, stamps, parents) if stamps else begin()
    history.authority = 'somebody'
    if ended and moves(history):
        history.end()
    arrays = Arrays()
    if begin is easing:
        with pytest.raises(TreeFileError, match="above 'child' cannot be saved: its interpola"
                           "tion Eased needs a name for files, such as name = 'my policy'"):
            save_history(history, arrays)
        return
    facts = json.loads(json.dumps(save_history(history, arrays)))
    saved = Saved(facts, memoryview(b''.join(arrays.parts)), WINDOW)
    twin = load_history(saved)
    saved.check_used_up()
    assert type(twin) is type(history)
    for other in (twin, twin.copy()):
        assert said_by(other) == said_by(history)


def test_all_classes_that_can_be_saved_are_tried():
    assert {type(begin()) for begin in BEGINNINGS} == {known.cls for known in HISTORIES.values()}


def said_by(history):
    asked = range(-1, 62)
    track = None
    if history.oldest_stamp is not None and history.fixed_parent:
        ends = history.oldest_stamp, history.latest_stamp
        track = history.track(*ends).at(np.clip(np.arange(70), *ends)).tobytes()
    return (history.child, history.parent, history.authority, len(history),
            history.oldest_stamp, history.newest_stamp, history.latest_stamp,
            [pose_at(history, at) for at in asked],
            [history.parent_at(at) for at in asked], [history.next_stamp(at) for at in asked],
            list(history.parents_between(BEGINNING, FOREVER)), track)


@every_kind
@given(stamps=some_stamps, stamp=STAMPS)
def test_append_is_insert_or_nothing(begin, stamps, stamp):
    history, other = history_of(begin, stamps), history_of(begin, stamps)
    pose = pose_number(77)
    before = [pose_at(history, at) for at in range(70)]
    if history.append(stamp, np.array(pose).tobytes()):
        assert other.insert(stamp, 'parent', pose)
        before = [pose_at(other, at) for at in range(70)]
    assert [pose_at(history, at) for at in range(70)] == before


@every_kind
@given(stamps=some_stamps, stamp=STAMPS)
def test_what_is_too_old_is_refused(begin, stamps, stamp):
    history = history_of(begin, stamps)
    too_old = history.is_too_old(stamp)
    if begin in CURVES:  # it is replaced, and continues from there
        assert too_old == (stamp < history.oldest_stamp)
        too_old = True
    assert history.insert(stamp, 'parent', pose_number(50)) == (not too_old)


@every_kind
@given(stamps=some_stamps, parents=some_parents, stamp=STAMPS)
def test_sample_with_which_an_edge_goes_on_moves_no_parent(begin, stamps, parents, stamp):
    history = history_of(begin, stamps, parents)
    pose = history.sample(history.latest_stamp)
    parent = history.parent
    if history.continues(parent, stamp, pose):
        before = [history.parent_at(at) for at in range(history.latest_stamp + 1)]
        history.insert(stamp, parent, pose)
        after = [history.parent_at(at) for at in range(len(before))]
        # The window may have moved past the oldest.
        assert all(then in (now, None) or now is None
                   for then, now in zip(before, after, strict=True))
        assert history.fixed_parent


@every_kind
def test_only_what_moves_is_cleared(begin):
    history = history_of(begin, [10])
    history.clear()
    assert moves(history) == (pose_at(history, 10) is None) == (not history.is_static)
    assert not moves(None)


# --- a sample that is valid until the next


def test_step_keeps_each_sample_until_the_next():
    history = history_of(stepping, [10, 20, 20, 30])
    assert [history.sample(stamp)[0] for stamp in (10, 19, 20, 29, 30)] == [0, 0, 2, 2, 3]
    for stamp in (9, 31):
        with pytest.raises(ExtrapolationException):
            history.sample(stamp)
    history.end()
    history.insert(40, 'parent', pose_number(4))
    assert history.sample(30)[0] == 3
    with pytest.raises(ExtrapolationException, match='had ended at that time'):
        history.sample(35)


# --- in a tree


def mixed_tree():
    """Return a buffer with an edge of each kind, one below the other."""
    buffer = BufferCore(cache_time=10**9)
    frames = ['map', 'jumping', 'eased', 'bent', 'moving', 'sensor']
    buffer.set_interpolation('jumping', Step())
    buffer.set_interpolation('eased', Eased())
    for number, (parent, child) in enumerate(zip(frames, frames[1:], strict=False)):
        stamps = range(number, 2_000_000, 50_000 + number)
        poses = [Pose.from_rotation_vector((0.0, 0.02 * number, 1e-7 * stamp),
                                           (1e-6 * stamp, number, 0.0)) for stamp in stamps]
        if child == 'bent':
            assert not buffer.insert_curve(parent, child, Spline.fit(stamps, poses, 1e4))
            continue
        for stamp, pose in zip(stamps, poses, strict=True):
            assert not buffer.insert(parent, child, stamp, pose, static=child == 'sensor')
    return buffer


@pytest.mark.parametrize(('target', 'source'), [
    ('map', 'jumping'), ('jumping', 'map'), ('map', 'sensor'), ('sensor', 'map'),
    ('jumping', 'sensor'), ('moving', 'sensor'), ('eased', 'bent'), ('bent', 'eased'),
    ('eased', 'sensor')])
@pytest.mark.parametrize('count', [30, 30_000])
def test_path_through_all_kinds_is_answered_as_one_by_one(target, source, count):
    buffer = mixed_tree()
    stamps = np.random.default_rng(count).integers(10, 1_900_000, count)
    stamps[:3] = 50_000, 100_000, 1_900_000  # the last of them is also a sample
    poses = buffer.lookup_many(target, source, stamps)
    for number in range(0, count, max(count // 100, 1)):
        assert_same_pose(
            poses[number], buffer.lookup_at(target, source, int(stamps[number])), reach=100.0)
    for number in range(3):
        stamp = int(stamps[number])
        assert_same_pose(poses[number], buffer.lookup_at(target, source, stamp), reach=100.0)


def test_snapshot_keeps_the_kinds():
    buffer = mixed_tree()
    still = buffer.snapshot()
    assert still.lookup_at('map', 'jumping', 49_999).x == 0.0
    assert buffer.edges() == still.edges()


def test_tree_asks_for_no_kind():
    """The tree uses only methods of an edge, so a new kind needs no change of the tree."""
    kinds = {known.cls.__name__ for known in HISTORIES.values()}
    asked = [(path.name, ast.unparse(node))
             for path in (Path(core.__file__).parent / 'tree').glob('*.py')
             for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)
             if ast.unparse(node.func) in ('isinstance', 'issubclass', 'type')
             and kinds & {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}]
    assert not asked
