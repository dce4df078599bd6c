# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The benchmark of growing work: its smallest sizes, its trees, and its stamps."""

import threading

from benchmark import motion
from benchmark.effort import Effort
from benchmark.exercise import Exercise, Task
from benchmark.groups import growth, growth_processes
from benchmark.motion import PERIOD, START
from benchmark.peers.finding import agree, Contestants
from benchmark.peers.ours import OurBuffer, OurCore
from benchmark.processes import hoard
from benchmark.rows import JAZZY, OURS, PLAIN, RAW, TF2_ROS
import numpy as np
import pytest
from tf_tree_py import BufferCore, Pose

SMALL = Effort(rounds=2, lookups=20, stream_s=0.2, streams=2, waits=1, simulated_s=1,
               samples=1000, sequences=1, sizes=2)


@pytest.fixture(scope='module')
def contestants():
    with Contestants() as found:
        yield found


def contents(rows):
    """Return the units by name, after a check that every value is a positive number."""
    for row in rows:
        assert OURS in row.values, row.name
        assert all(values and min(values) > 0.0 for values in row.values.values()), row.name
    return {row.name: row.unit for row in rows}


def true_pose(robot, stamp):
    """Return the pose of a robot's source in its target, at the stamp of samples."""
    pose = Pose()
    for edge in robot.moving:
        pose = pose @ Pose(*motion.pose_at(edge, stamp))
    return pose


# --- trees

@pytest.mark.parametrize('frames', [10, 1_000])
def test_further_frames_do_not_lengthen_the_chain(frames):
    robot, chain = motion.robot(f'wide{frames}'), motion.chain(5)
    assert (robot.target, robot.source, robot.moving) == (chain.target, chain.source, chain.edges)
    buffer = BufferCore()
    for edge in robot.edges:
        assert not edge.static
        buffer.insert(edge.parent, edge.child, START, motion.pose_at(edge, START))
    assert buffer.statistics().frames == frames
    tree = buffer.lookup_tree(robot.target, START)
    assert len(tree) == frames
    assert {edge.parent for edge in robot.edges[5:]} == {robot.target}
    for edge in robot.edges[5:]:
        np.testing.assert_allclose(tree[edge.child], motion.pose_at(edge, START), atol=1e-12)
    np.testing.assert_allclose(
        buffer.lookup(robot.target, robot.source, START), true_pose(robot, START), atol=1e-12)


@pytest.mark.parametrize('peer', [OurBuffer, OurCore])
def test_answers_beside_many_frames_and_in_long_histories_are_right(peer):
    for task in (Task('wide100', 0.1, False, 5), Task('chain5', 10.0, False, 5, anywhere=True)):
        exercise = Exercise(peer(), task)
        for sample in (1, 5, 8):
            stamp = START + sample * PERIOD
            # Raises ``Disagreement`` otherwise.
            agree({'answer': [exercise.answer(stamp)],
                   'truth': [list(true_pose(exercise.robot, stamp))]})


# --- stamps

class Noting(OurCore):
    """Notes the stamps of its lookups."""

    def reset(self, robot, history_s):
        super().reset(robot, history_s)
        self.stamps = []
        self.lookup = lambda target, source, stamp: self.stamps.append(stamp)


def stamps_of(exercise):
    """Return the stamps of one turn."""
    exercise.peer.stamps.clear()
    exercise.take_turn()
    return list(exercise.peer.stamps)


def test_old_stamps_are_spread_over_the_whole_history_and_repeat_in_every_run():
    task = Task('chain5', 10.0, False, 200, anywhere=True)
    exercise = Exercise(Noting(), task)
    exercise.take_turn()
    turn = stamps_of(exercise)
    span = 10.0 * 1e9
    newest = START + span + 300 * PERIOD / 5  # in the middle of the turn
    ages = (newest - np.array(turn)) / span
    counts, _ = np.histogram(ages, bins=4, range=(0.0, 1.0))
    assert counts.min() >= 36 and counts.sum() == 200
    # None is close to the one before, so that no search can begin there.
    assert np.abs(np.diff(turn)).min() > 0.2 * span
    again = Exercise(Noting(), task)
    again.take_turn()
    assert stamps_of(again) == turn


def test_a_changed_exercise_continues_on_the_same_buffer():
    exercise = Exercise(Noting(), Task('chain5', 1.0, False, 7, anywhere=True))
    assert len(stamps_of(exercise)) == 7
    exercise.change(latest=True, count=3)
    assert stamps_of(exercise) == [0, 0, 0]
    exercise.change(latest=False, count=4)
    assert len(stamps_of(exercise)) == 4 and 0 not in stamps_of(exercise)


# --- threads

@pytest.mark.parametrize('number', [1, 2, 4])
def test_threads_do_all_their_lookups_on_one_buffer_and_get_its_answers(number):
    exercise = Exercise(OurCore(), Task('chain5', 1.0, False, 5))
    look = growth.looker(exercise, START + 50 * PERIOD)
    answers, identities, together = [], set(), threading.Barrier(number)

    def noted():
        if (identity := threading.get_ident()) not in identities:
            identities.add(identity)
            together.wait()
        answers.append(look())

    assert growth.lookups_a_second(noted, number, 40) > 0.0
    assert len(identities) == number and len(answers) == 40
    assert set(answers) == {look()}
    agree({'answer': [list(answers[0])],
           'truth': [list(true_pose(exercise.robot, START + 50 * PERIOD))]})


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_a_failed_lookup_in_a_thread_is_no_result():
    calls = iter(range(5))
    with pytest.raises(RuntimeError, match='a lookup failed'):
        growth.lookups_a_second(lambda: next(calls), 2, 20)


# --- memory

@pytest.mark.parametrize('each', [100, 1_000])
def test_every_edge_gets_its_samples(each):
    edges, inserted = motion.wide(9).edges, []
    hoard.insert_all(lambda *sample: inserted.append(sample), edges, each)
    assert [edge for edge, _, _ in inserted[::each]] == edges
    assert len(inserted) == each * len(edges)
    stamps = [stamp for _, stamp, _ in inserted[:each]]
    assert stamps == sorted(set(stamps))


# --- the groups

def test_groups_in_this_process(contestants):
    peers = {name for name in (TF2_ROS, JAZZY) if contestants.has(name)}
    rows = list(growth.samples(contestants, SMALL))
    assert contents(rows) == {
        f'{quantity}, {size} samples': 'us'
        for quantity in ('old stamp', 'latest') for size in ('100', '1,000')}
    rows_of_frames = list(growth.frames(contestants, SMALL))
    assert contents(rows_of_frames) == {
        f'{quantity}, {size} frames': unit
        for quantity, unit in (('lookup', 'us'), ('insertion', 'us'), ('whole tree', 'us a frame'))
        for size in (10, 100)}
    for row in rows + rows_of_frames[:4]:
        assert peers | {OURS} <= set(row.values), row.name
    rows = list(growth.threads(contestants, SMALL))
    assert contents(rows) == dict.fromkeys(
        ('in total, 1 thread', 'in total, 2 threads'), 'lookups a second')
    assert all(peers | {OURS} <= set(row.values) for row in rows)
    [ratio] = [one for one in rows[1].comparisons if one.unit == 'x 1 thread']
    assert ratio.spread.least <= rows[1].values[OURS][0] / rows[0].values[OURS][0] <= (
        ratio.spread.greatest)


def test_memory_is_that_of_the_samples(contestants):
    rows = list(growth_processes.memory(contestants, SMALL._replace(sizes=1)))
    assert contents(rows) == {'in all, 100 samples': 'bytes a sample'}
    # A stamp and seven numbers, of eight bytes each, are the least that a sample can have.
    assert 64.0 <= rows[0].values[OURS][0] < 128.0


def test_every_message_of_a_slow_stream_arrives(contestants):
    rows = {row.name: row for row in growth_processes.rates(
        contestants, SMALL._replace(sizes=1))}
    assert contents(rows.values()) == {
        'CPU, 500 Hz': '% of a core', 'arrived, 500 Hz': '%', 'sent, 500 Hz': '%'}
    assert rows['arrived, 500 Hz'].values == {OURS: [100.0], PLAIN: [100.0]}
    # A share in percent; a busy machine may send more slowly, and then catch up.
    assert all(1.0 < max(values) < 200.0 for values in rows['sent, 500 Hz'].values.values())


def test_bags_of_a_folder_are_read_one_by_one_and_as_one(contestants):
    rows = list(growth_processes.bags(contestants, SMALL))
    assert contents(rows) == {
        f'{quantity}, {size}': unit for quantity, unit in (
            ('list', 'ms a bag'), ('open each, and a lookup', 'ms a bag'),
            ('open as one bag', 'ms a bag'), ('lookup in that', 'us'))
        for size in ('1 bag', '10 bags')}
    assert {RAW} == {name for row in rows for name in row.values} - {OURS}
