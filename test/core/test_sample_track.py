# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import threading

from effort import examples
from hypothesis import example, given, strategies as st
import numpy as np
import pytest
from strategies import assert_same_pose, poses as unit_poses, random_poses
from tf_tree_py import BufferCore
from tf_tree_py.core import InvalidArgumentException, Kind, Pose, TransformException, UNLIMITED
from tf_tree_py.core.geometry import se3

NAN = float('nan')
EDGES = [('map', 'base'), ('odom', 'base'), ('base', 'map'), ('base', 'arm'), ('/map', '/base'),
         ('', 'base'), ('map', ''), ('map', 'map')]

rows = st.one_of(
    unit_poses,
    st.sampled_from([
        (0.0,) * 7, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 2.0), (NAN, 0, 0, 0, 0, 0, 1),
        (1, 0, 0, 0, NAN, 0, 1), (float('inf'), 0, 0, 0, 0, 0, 1),
        (1e308, 1e308, 1e308, 0, 0, 0, 1), (0, 0, 0, 1e-170, 0, 0, 0), (0, 0, 0, 0, 1e200, 0, 0),
        (1, 1, 1, 0, 0, 0, 1 + 1e-7), (1, 1, 1, 0, 0, 0, 1 + 1e-14)]))
samples = st.lists(st.tuples(st.integers(-3, 30), rows), max_size=12)
tracks = st.tuples(st.sampled_from(EDGES), samples, st.sampled_from(['one', 'other']),
                   st.booleans())


def told(incidents):
    return list(map(str, incidents))


def contents(buffer):
    """Return the whole content of a buffer: its histories, and its public view."""
    histories = {
        child: [*history.copy_between(-2**63, 2**63 - 1)[0].tolist(), history.parent]
        for child, history in buffer.intake.tree.histories.items()
        if not history.is_static and history.latest_stamp is not None}
    return buffer.frames(), buffer.edges(), buffer.statistics(), histories


def assert_same(one, other):
    assert contents(one) == contents(other)
    for parent, child, *_ in one.edges():
        for stamp in range(-4, 32):
            answers = []
            for buffer in (one, other):
                try:
                    answers.append(tuple(buffer.lookup_at(parent, child, stamp)))
                except TransformException as error:
                    answers.append(str(error))
            expected = answers[1]
            assert answers[0] == (expected if isinstance(expected, str) else pytest.approx(
                expected, nan_ok=True, rel=1e-12, abs=1e-12))


@examples(6)
@given(st.sampled_from([0, 4, 12, UNLIMITED]), st.lists(tracks, max_size=5),
       st.sampled_from([None, 9]), st.sampled_from([None, 3]))
@example(4, [(('map', 'base'), [(20, Pose()), (3, Pose()), (21, Pose())], 'one', False)], None,
         None)
# The whole track is older than the window.
@example(4, [(('map', 'base'), [(20, Pose())], 'one', False),
             (('map', 'base'), [(3, Pose()), (4, Pose())], 'one', False)], None, None)
def test_track_is_its_samples_inserted_one_by_one(window, arrivals, now, limit):
    options = {'max_future': 5, 'now': lambda: now} if now else {}
    options['clear_on_jump_back'] = limit
    whole, single = BufferCore(window, **options), BufferCore(window, **options)
    for (parent, child), track, authority, static in arrivals:
        if static:
            for buffer in (whole, single):
                buffer.insert(parent, child, 0, Pose(), static=True, authority=authority)
            continue
        incidents = whole.insert_track(
            parent, child, [stamp for stamp, _ in track],
            np.reshape(np.array([pose for _, pose in track], dtype=float), (-1, 7)),
            authority=authority)
        expected = [incident for stamp, pose in track for incident in single.insert(
            parent, child, stamp, pose, authority=authority)]
        assert told(incidents) == told(expected)
    assert_same(whole, single)


@given(st.lists(st.integers(-2**63, 2**63 - 1), max_size=6),
       st.sampled_from([10**18, 2**62, 2**63 - 1, UNLIMITED]))
def test_stamps_may_be_any_of_64_bits(stamps, window):
    whole, single = BufferCore(window), BufferCore(window)
    incidents = whole.insert_track('map', 'base', stamps, [Pose()] * len(stamps))
    expected = [incident for stamp in stamps
                for incident in single.insert('map', 'base', stamp, Pose())]
    assert told(incidents) == told(expected)
    assert contents(whole) == contents(single)


def test_unsorted_and_late_samples_go_where_they_belong():
    rng = np.random.default_rng(3)
    stamps = rng.permutation(np.repeat(np.arange(500), 2))
    poses = random_poses(rng, len(stamps))
    whole, single = BufferCore(UNLIMITED), BufferCore(UNLIMITED)
    for part in np.array_split(np.arange(len(stamps)), 7):
        assert whole.insert_track('map', 'base', stamps[part], poses[part]) == []
    for stamp, pose in zip(stamps.tolist(), poses, strict=True):
        single.insert('map', 'base', stamp, pose)
    asked = np.linspace(0, 499, 1999).astype(int)
    assert (whole.lookup_many('map', 'base', asked) == single.lookup_many(
        'map', 'base', asked)).all()
    assert whole.edges() == single.edges()


def test_what_the_buffer_does_not_keep_takes_no_memory():
    buffer = BufferCore(1_000_000_000)
    stamps = np.arange(100_000) * 1_000_000
    buffer.insert_track('map', 'base', stamps, np.tile(se3.IDENTITY, (len(stamps), 1)))
    assert buffer.edges()[0].samples == 1002
    assert len(buffer.intake.tree.histories['base'].stamps) < 3000


def test_callers_arrays_stay_theirs():
    buffer = BufferCore()
    poses = np.array([[0, 0, 0, 0, 0, 0, 2.0]] * 3)
    stamps = np.arange(1, 4)
    buffer.insert_track('map', 'base', stamps, poses)
    assert poses[0, 6] == 2.0
    poses[:], stamps[:] = 7.0, 9
    assert buffer.lookup('map', 'base', 2) == Pose()


def test_waiters_are_woken_by_a_track():
    buffer = BufferCore(UNLIMITED)
    buffer.insert('map', 'base', 1, Pose())

    def insert():
        buffer.insert_track('map', 'base', np.arange(1, 100), np.tile(Pose(1.0), (99, 1)))

    timer = threading.Timer(0.05, insert)
    timer.start()
    assert buffer.lookup_within(60.0, 'map', 'base', 50) == Pose(1.0)
    timer.join()


# --- valid poses

MATRIX = Pose.from_xyz_rpy(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)


def scipy_transform(poses):
    transform = pytest.importorskip('scipy.spatial.transform')
    if not hasattr(transform, 'RigidTransform'):
        pytest.skip('this scipy has no RigidTransform')
    poses = np.asarray(poses)
    return transform.RigidTransform.from_components(
        poses[..., :3], transform.Rotation.from_quat(poses[..., 3:]))


def rotations(poses):
    from scipy.spatial.transform import Rotation
    return Rotation.from_quat(np.asarray(poses)[..., 3:])


@pytest.mark.parametrize('given', [
    MATRIX, list(MATRIX), np.array(MATRIX), np.array(MATRIX, np.longdouble), MATRIX.as_matrix(),
    MATRIX.as_matrix().tolist(), iter(MATRIX)])
def test_one_pose_may_be_written_in_many_ways(given):
    buffer = BufferCore()
    assert buffer.insert('map', 'base', 1, given) == []
    assert_same_pose(buffer.lookup('map', 'base'), MATRIX)


def test_scipys_objects_are_poses():
    buffer = BufferCore()
    assert not buffer.insert('map', 'base', 1, scipy_transform(MATRIX))
    assert_same_pose(buffer.lookup('map', 'base'), MATRIX)
    assert not buffer.insert('map', 'camera', 1, rotations(MATRIX))
    assert_same_pose(buffer.lookup('map', 'camera'), (0.0, 0.0, 0.0, *MATRIX.rotation))


@pytest.mark.parametrize('make', [
    np.asarray, list, tuple, se3.as_matrix_many, lambda poses: list(se3.as_matrix_many(poses)),
    lambda poses: [Pose(*pose) for pose in poses], scipy_transform,
    lambda poses: [scipy_transform(pose) for pose in poses],
    lambda poses: [poses[0], *se3.as_matrix_many(poses[1:])]])
def test_many_poses_may_be_written_in_many_ways(make):
    poses = random_poses(np.random.default_rng(1), 5)
    buffer = BufferCore()
    assert buffer.insert_track('map', 'base', range(1, 6), make(poses)) == []
    for stamp, pose in enumerate(poses.tolist(), 1):
        assert_same_pose(buffer.lookup('map', 'base', stamp), pose)


def test_many_rotations_are_poses():
    poses = random_poses(np.random.default_rng(1), 5)
    buffer = BufferCore()
    buffer.insert_track('map', 'base', range(1, 6), rotations(poses))
    assert_same_pose(buffer.lookup('map', 'base', 3), (0.0, 0.0, 0.0, *poses[2, 3:]))


@pytest.mark.parametrize(('pose', 'match'), [
    ((1, 2, 3), r'shape \(3,\) is not a pose: .*; Pose\(x, y, z\) makes'),
    ((0, 0, 0, 1), r'from a quaternion'), (range(6), 'six numbers .* Pose.from_xyz_rpy'),
    (np.eye(3), 'Rotation.from_matrix'), (np.eye(4)[:3], 'last row'),
    (None, 'None is not a pose'),
    ('here', "'here' is not a pose: a pose is a Pose, seven numbers"),
    ('0000001', "'0000001' is not a pose"), (b'0000001', "b'0000001' is not a pose"),
    ({0, 1, 2, 3, 4, 5, 6}, 'is not a pose'), (dict.fromkeys(range(7)), 'is not a pose'),
    (2 * np.eye(4), 'last row of the matrix is not 0 0 0 1'),
    (np.diag([2, 1, 1, 1]), 'not a rotation'), (np.eye(7), r'shape \(7, 7\)'),
    ({'x': 1.0}, "{'x': 1.0} is not a pose"),
])
def test_what_is_no_pose_is_answered_with_what_is(pose, match):
    buffer = BufferCore()
    with pytest.raises(InvalidArgumentException, match=match):
        buffer.insert('map', 'base', 1, pose)
    assert buffer.frames() == []


@pytest.mark.parametrize(('stamps', 'poses', 'match'), [
    ([1, 2], np.zeros((3, 7)), 'not 2 stamps and 3 poses'),
    ([1, 2], np.zeros((2, 6)), r'shape \(2, 6\) is not a row of poses: .*six numbers'),
    ([1], Pose(), r'shape \(7,\) is not a row of poses'), ([1], np.eye(4), r'shape \(4, 4\)'),
    ([1, 2], [Pose(), None], 'None is not a pose'), ([1], None, 'not a row of poses'),
    ([1, 2], [np.eye(4), 2 * np.eye(4)], r'poses\[1\]: not a rigid transform'),
    ([1.0], [Pose()], 'integer nanoseconds'), ([1], 'x', "'x' is not a row of poses"),
])
def test_what_is_no_track_is_answered_with_what_is(stamps, poses, match):
    buffer = BufferCore()
    with pytest.raises(InvalidArgumentException, match=match):
        buffer.insert_track('map', 'base', stamps, poses)
    assert buffer.frames() == []


def test_names_of_a_track_are_strings():
    with pytest.raises(InvalidArgumentException, match='child is the name of a frame, not 7'):
        BufferCore().insert_track('map', 7, [1], [Pose()])


def test_matrices_that_are_not_finite_are_refused_one_by_one():
    matrices = se3.as_matrix_many(random_poses(np.random.default_rng(1), 3))
    matrices[1, 0, 3] = NAN
    buffer = BufferCore()
    refused, = buffer.insert_track('map', 'base', [1, 2, 3], matrices)
    assert (refused.kind, refused.stamp) == (Kind.NOT_FINITE, 2)
    assert buffer.edges()[0].samples == 2


def test_nothing_is_an_empty_track():
    buffer = BufferCore()
    for nothing in ([], np.empty((0, 7)), np.empty((0, 4, 4))):
        assert buffer.insert_track('map', 'base', [], nothing) == []
    assert buffer.frames() == []
