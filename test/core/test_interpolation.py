# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A policy that a user writes in one file, wherever an edge is looked up; see test_edges too."""

import pickle
import threading

import numpy as np
from policies import HoldNewest
import pytest
from strategies import assert_same_pose
from tf_tree_py import BufferCore, load, Pose
from tf_tree_py.core import (
    ExtrapolationException,
    InvalidArgumentException,
    LATEST,
    TreeFileError,
)
from tf_tree_py.core.edges.interpolation import Interpolation, Linear

MS = 1_000_000
HOLD = 200 * MS
NEWEST = 1_000 * MS


class Halfway(Interpolation):
    """Jumps half way between two samples."""

    name = 'half way, of a test'

    def between(self, samples, index, stamp):
        begin, end = samples.stamps[index:index + 2]
        return samples.pose(index if 2 * stamp < begin + end else index + 1)


def pose_at(stamp):
    return Pose.from_xyz_rpy(x=1e-9 * stamp, y=0.5, yaw=2e-9 * stamp)


@pytest.fixture
def buffer():
    """Return a lift at 10 Hz that is held, and an arm on it at 100 Hz that goes on for 150 ms."""
    made = BufferCore()
    made.set_interpolation('lift', HoldNewest(HOLD))
    for stamp in range(100 * MS, NEWEST + 1, 100 * MS):
        made.insert('base', 'lift', stamp, pose_at(stamp))
    for stamp in range(100 * MS, NEWEST + 150 * MS + 1, 10 * MS):
        made.insert('lift', 'arm', stamp, pose_at(-stamp))
    return made


def snapshot(buffer, _):
    return buffer.snapshot()


def pickled(buffer, _):
    return pickle.loads(pickle.dumps(buffer.snapshot()))


def saved(buffer, folder):
    buffer.save(folder / 'run.tftree')
    return load(folder / 'run.tftree', verify=True)


def aided_and_corrected(buffer, _):
    stamps = np.arange(50 * MS, NEWEST + 300 * MS, 2 * MS)
    buffer.aid('lift', stamps, np.tile([0.0, 0.0, 2.0], (len(stamps), 1)))
    buffer.correct('lift', Pose())
    return buffer


everywhere = pytest.mark.parametrize('place', [
    lambda buffer, _: buffer, snapshot, pickled, saved, aided_and_corrected])


@everywhere
def test_newest_sample_is_held_and_no_longer(buffer, place, tmp_path):
    tree = place(buffer, tmp_path)
    for stamp in (NEWEST, NEWEST + 1, NEWEST + HOLD):
        assert_same_pose(tree.lookup('base', 'lift', stamp), pose_at(NEWEST))
    with pytest.raises(ExtrapolationException, match='1.000000000, 200 ms older') as failed:
        tree.lookup('base', 'lift', NEWEST + HOLD + 1)
    assert failed.value.latest == NEWEST


@everywhere
@pytest.mark.parametrize('step', [MS, 10_000])  # the latter is by polynomials
def test_many_stamps_are_answered_as_one_by_one(buffer, place, tmp_path, step):
    tree = place(buffer, tmp_path)
    stamps = np.arange(900 * MS, NEWEST + 150 * MS + 1, step)
    poses = tree.lookup_many('base', 'arm', stamps)
    for number in range(0, len(stamps), max(len(stamps) // 50, 1)):
        assert_same_pose(poses[number], tree.lookup_at('base', 'arm', int(stamps[number])))
    _, valid = tree.lookup_many('base', 'lift', stamps + HOLD, outside='mask')
    assert valid.tolist() == (stamps <= NEWEST).tolist()


def test_latest_is_not_held_back_and_not_newer_than_all_data(buffer):
    assert buffer.latest_common_time('base', 'arm') == NEWEST + 150 * MS
    assert buffer.latest_common_time('base', 'lift') == NEWEST
    stamp, pose = buffer.lookup_stamped('base', 'arm', LATEST)
    assert stamp == NEWEST + 150 * MS
    assert_same_pose(pose, pose_at(NEWEST) @ pose_at(-stamp))
    assert buffer.lookup_tree('base')['arm'] == pose
    for later in range(2):
        buffer.insert('lift', 'arm', NEWEST + HOLD + later, pose_at(0))
        assert buffer.latest_common_time('base', 'arm') == NEWEST + HOLD


@pytest.mark.parametrize('holds_for', [2**63 - 2, 2**63, 2**64])
def test_newest_sample_may_be_held_for_ever(holds_for):
    buffer = BufferCore()
    buffer.set_interpolation('lift', HoldNewest(holds_for))
    buffer.insert('base', 'lift', NEWEST, pose_at(1))
    assert buffer.lookup_stamped('base', 'lift', LATEST) == (NEWEST, pose_at(1))
    last = 2**63 - 1
    assert buffer.lookup('base', 'lift', last) == pose_at(1)
    assert buffer.lookup_many('base', 'lift', [NEWEST, last]).tolist() == [list(pose_at(1))] * 2
    buffer.insert('base', 'lift', NEWEST + 1, pose_at(2))
    assert buffer.lookup('base', 'lift', last) == pose_at(2)


def test_samples_and_edges_are_those_that_arrived(buffer):
    lift = next(edge for edge in buffer.edges() if edge.child == 'lift')
    assert lift.latest == NEWEST and buffer.stamps_of('lift')[-1] == NEWEST
    assert [stamp for stamp, _ in buffer.samples_around('lift', NEWEST + MS)] == [NEWEST]
    assert buffer.parents_at(NEWEST + HOLD)['lift'] == 'base'
    assert 'lift' not in buffer.parents_at(NEWEST + HOLD + 1)


def test_held_edge_is_not_predicted_but_held(buffer):
    held = buffer.predict('base', 'lift', NEWEST + HOLD, horizon=10**9)
    assert held.beyond == 0 and held.pose == pose_at(NEWEST)
    assert buffer.predict('base', 'lift', NEWEST + HOLD + 1, horizon=10**9).beyond == HOLD + 1


def test_covariance_of_a_held_pose_is_that_of_the_newest(buffer):
    buffer.insert('base', 'lift', NEWEST, pose_at(NEWEST), covariance=np.eye(6))
    _, newest = buffer.lookup_uncertain('base', 'lift', NEWEST)
    _, held = buffer.lookup_uncertain('base', 'lift', NEWEST + HOLD)
    assert newest.trace() > 0.0 and (held == newest).all()


def test_end_of_an_edge_is_not_held(buffer):
    buffer.intake.tree.histories['lift'].end()
    with pytest.raises(ExtrapolationException):
        buffer.lookup_at('base', 'lift', NEWEST + 1)
    assert 'lift' not in buffer.parents_at(NEWEST + 1)


def test_waiter_is_woken_by_the_policy_and_by_a_sample_that_reaches_far_enough():
    buffer = BufferCore(now=lambda: NEWEST)
    buffer.insert('base', 'lift', NEWEST, pose_at(1))
    for stamp, change in (
            (NEWEST + HOLD, lambda: buffer.set_interpolation('lift', HoldNewest(HOLD))),
            (NEWEST + 2 * HOLD, lambda: buffer.insert('base', 'lift', NEWEST + HOLD, pose_at(2)))):
        found = []
        # A wait that nothing wakes would ask once more at its end, and answer.
        waiter = threading.Thread(daemon=True, target=lambda stamp=stamp, found=found: (
            found.append(buffer.lookup_within(3600.0, 'base', 'lift', stamp))))
        waiter.start()
        while not len(buffer.waiting):
            assert waiter.is_alive()
        change()
        waiter.join(60.0)
        assert found == [buffer.lookup('base', 'lift', stamp)]


def test_gyroscope_measures_between_samples_and_the_policy_the_rest():
    buffer = BufferCore()
    buffer.set_interpolation('lift', Halfway())
    for stamp in (0, 100 * MS, 300 * MS):
        buffer.insert('base', 'lift', stamp, Pose(x=float(stamp // (300 * MS))))
    rates = np.zeros((101, 3))
    rates[:50, 2] = 20.0
    buffer.aid('lift', np.arange(0, 101 * MS, MS), rates)
    assert buffer.lookup_at('base', 'lift', 50 * MS).as_rpy()[2] == pytest.approx(0.5, abs=0.01)
    stamps = np.array([150, 199, 201]) * MS
    one_by_one = [buffer.lookup_at('base', 'lift', stamp).x for stamp in stamps.tolist()]
    assert one_by_one == [0.0, 0.0, 1.0]
    assert buffer.lookup_many('base', 'lift', stamps)[:, 0].tolist() == one_by_one


def test_policy_may_change_while_the_gyroscope_stays():
    buffer = BufferCore()
    for stamp in (0, 100 * MS):
        buffer.insert('base', 'lift', stamp, Pose.from_xyz_rpy(yaw=1e-8 * stamp))
    rates = np.zeros((101, 3))
    rates[:50, 2] = 20.0
    buffer.aid('lift', np.arange(0, 101 * MS, MS), rates)
    before = buffer.lookup_at('base', 'lift', 50 * MS)
    assert before.as_rpy()[2] > 0.9
    for policy in (HoldNewest(HOLD), Halfway(), Linear()):
        buffer.set_interpolation('lift', policy)
        assert buffer.lookup_at('base', 'lift', 50 * MS) == before


def test_cleared_and_refilled_edge_keeps_its_policy_and_a_removed_one_does_not(buffer):
    buffer.clear()
    buffer.insert('base', 'lift', NEWEST, pose_at(0))
    assert buffer.lookup('base', 'lift', NEWEST + HOLD) == pose_at(0)
    buffer.remove_frame('lift')
    buffer.insert('base', 'lift', NEWEST, pose_at(0))
    with pytest.raises(ExtrapolationException):
        buffer.lookup('base', 'lift', NEWEST + HOLD)


def test_smoothed_edge_keeps_its_policy(buffer):
    buffer.correct('lift', Pose(x=1.0))
    buffer.insert('base', 'lift', 2 * NEWEST, pose_at(0))
    held = buffer.smoothed().lookup('base', 'lift', 2 * NEWEST + HOLD)
    assert held == buffer.smoothed().lookup('base', 'lift', 2 * NEWEST)


@pytest.mark.parametrize(('policy', 'why'), [
    (HoldNewest, "HoldNewest'> is not an Interpolation: pass an object, not the class"),
    ('linear', "'linear' is not an Interpolation"),
    (HoldNewest(0.2), 'holds_for of HoldNewest is 0.2, and must be integer nanoseconds'),
    (HoldNewest(-1), 'holds_for of HoldNewest is -1'),
    (HoldNewest(True), 'holds_for of HoldNewest is True'),
])
def test_what_is_no_policy_is_refused(buffer, policy, why):
    with pytest.raises(InvalidArgumentException, match=why):
        buffer.set_interpolation('lift', policy)


def test_edge_without_samples_is_refused_with_what_it_is(buffer):
    buffer.insert('arm', 'camera', 0, Pose(), static=True)
    with pytest.raises(InvalidArgumentException, match='The edge arm -> camera is static, and has'
                       ' no samples to interpolate between. Insert it as a moving edge'):
        buffer.set_interpolation('camera', HoldNewest(HOLD))


def test_class_that_another_process_does_not_have_is_named(buffer, tmp_path, monkeypatch):
    buffer.save(tmp_path / 'run.tftree')
    monkeypatch.setattr(HoldNewest, 'name', 'renamed')
    with pytest.raises(TreeFileError, match="the interpolation 'hold newest', "
                       'which is not defined here: import the module that defines it first'):
        load(tmp_path / 'run.tftree')
    buffer.save(tmp_path / 'again.tftree')
    assert load(tmp_path / 'again.tftree').lookup('base', 'lift', NEWEST + HOLD)


def test_subclass_of_linear_with_poses_of_its_own_has_them_at_many_stamps(buffer):
    class Early(Linear):

        def between(self, samples, index, stamp):
            return samples.pose(index + 1)

    buffer.set_interpolation('lift', Early())
    stamps = np.array([301, 350, 400, 401]) * MS
    found = buffer.lookup_many('base', 'lift', stamps)
    assert found.tolist() == [list(buffer.lookup('base', 'lift', int(stamp))) for stamp in stamps]


class Answers(Interpolation):

    def __init__(self, answer):
        self.answer = answer

    def between(self, samples, index, stamp):
        return self.answer()


@pytest.mark.parametrize(('answer', 'why'), [
    (lambda: 1 // 0, 'raised ZeroDivisionError'),
    (lambda: None, 'returned no pose: None is not a pose'),
    (lambda: (1.0, 2.0, 3.0), r'returned no pose: an array of the shape \(3,\) is not a pose'),
    (lambda: (np.nan, 0, 0, 0, 0, 0, 1), r'returned \(nan, 0.0, .* not finite'),
    (lambda: (0, 0, 0, 0, 0, 0, 5), 'returned .*whose quaternion does not have length one'),
])
def test_interpolation_that_gives_no_pose_is_named_to_who_asks(buffer, answer, why):
    buffer.set_interpolation('lift', Answers(answer))
    for ask in (lambda: buffer.lookup('base', 'lift', 150 * MS),
                lambda: buffer.lookup_within(9.0, 'base', 'lift', 150 * MS),
                lambda: buffer.lookup_many('base', 'lift', [150 * MS])):
        with pytest.raises(InvalidArgumentException, match=(
                f"Answers.between, the interpolation of the edge above 'lift', {why}")):
            ask()
    assert buffer.lookup('base', 'lift', 200 * MS) == pose_at(200 * MS)


def test_waiter_gets_the_fault_of_an_interpolation_and_who_inserts_does_not():
    buffer = BufferCore(now=lambda: NEWEST)
    buffer.set_interpolation('lift', Answers(lambda: 1 // 0))
    buffer.insert('base', 'lift', NEWEST, pose_at(1))
    found = []

    def wait():
        try:
            buffer.lookup_within(3600.0, 'base', 'lift', NEWEST + 1)
        except InvalidArgumentException as error:
            found.append(str(error))

    waiter = threading.Thread(target=wait, daemon=True)
    waiter.start()
    while not len(buffer.waiting):
        assert waiter.is_alive()
    assert not buffer.insert('base', 'lift', NEWEST + 2, pose_at(2))
    waiter.join(60.0)
    assert 'ZeroDivisionError' in found[0]


def test_interpolation_without_between_says_so(buffer):
    buffer.set_interpolation('lift', Interpolation())
    with pytest.raises(InvalidArgumentException, match=r'Interpolation must define between\(\)'):
        buffer.lookup('base', 'lift', 150 * MS)


class Wide(Interpolation):
    """Looks at two samples on either side, as a cubic would."""

    def between(self, samples, index, stamp):
        near = [number for number in range(index - 1, index + 3)
                if samples.first() <= number < len(samples.stamps)]
        return Pose(x=float(sum(samples.stamps[number] for number in near)))


def test_samples_on_either_side_are_there_at_many_stamps_too(buffer):
    buffer.set_interpolation('lift', Wide())
    stamps = np.array([350, 360, 450]) * MS
    assert buffer.lookup_many('base', 'lift', stamps)[:, 0].tolist() == [
        buffer.lookup('base', 'lift', stamp).x for stamp in stamps.tolist()]


class Previous(Interpolation):
    """The pose of the sample before the two around a stamp, if there is one."""

    def between(self, samples, index, stamp):
        joined = index - 1 >= samples.first() and samples.joins(index - 1)
        return samples.pose(index - 1 if joined else index)


def test_policy_that_asks_for_the_first_sample_gives_one_answer_for_each_stamp():
    """A single lookup finds expired samples in memory, which a copy for many stamps lacks."""
    buffer = BufferCore(cache_time=NEWEST)
    buffer.set_interpolation('lift', Previous())
    for stamp in range(0, 4 * NEWEST, 100 * MS):
        buffer.insert('base', 'lift', stamp, pose_at(stamp))
    samples = buffer.intake.tree.histories['lift']
    assert samples.first() > 0
    stamps = [stamp + MS for stamp in samples.stamps[samples.first():-1]]
    assert buffer.lookup_many('base', 'lift', stamps).tolist() == [
        list(buffer.lookup('base', 'lift', stamp)) for stamp in stamps]


# --- files


class Forgetful(Interpolation):
    name = 'forgetful, of a test'

    def __init__(self, data=1):
        self.data = data

    def between(self, samples, index, stamp):
        return samples.pose(index)


class Saves(Forgetful):
    name = 'saves, of a test'

    def save(self, arrays):
        return self.data()


@pytest.mark.parametrize(('policy', 'why'), [
    (Forgetful(), 'its interpolation Forgetful has data, so it needs methods save and load'),
    (Saves(lambda: None), r'save\(\) of its interpolation Saves must return a dict'),
    (Saves(lambda: 1 // 0), r'save\(\) of its interpolation Saves raised ZeroDivisionError'),
    (Saves(lambda: {'data': np.int64(1)}), 'the tree cannot be saved: .*int64'),
])
def test_policy_that_cannot_be_saved_is_refused_before_it_is_lost(buffer, tmp_path, policy, why):
    buffer.set_interpolation('lift', policy)
    with pytest.raises(TreeFileError, match=why):
        buffer.save(tmp_path / 'run.tftree')
    with pytest.raises(TreeFileError, match=why):
        pickle.dumps(buffer.snapshot())


def test_fault_of_load_is_one_of_the_file(buffer, tmp_path):
    buffer.set_interpolation('lift', Saves(lambda: {'name': 'of the user'}))
    buffer.save(tmp_path / 'run.tftree')
    assert load(tmp_path / 'run.tftree')
    Saves.load = classmethod(lambda cls, saved: 1 // 0)
    try:
        with pytest.raises(TreeFileError, match=r"load\(\) of its interpolation 'saves, of a "
                           "test' raised ZeroDivisionError"):
            load(tmp_path / 'run.tftree')
    finally:
        del Saves.load


def test_policy_of_a_frame_without_samples_goes_with_the_frame():
    buffer = BufferCore()
    buffer.set_interpolation('lift', HoldNewest(HOLD))
    buffer.remove_frame('lift')
    buffer.insert('base', 'lift', NEWEST, pose_at(1))
    with pytest.raises(ExtrapolationException):
        buffer.lookup('base', 'lift', NEWEST + 1)
