# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The last seconds of received messages become a bag, with all that a doctor needs."""

from contextlib import suppress
import json

from bags import START
from hypothesis import given, strategies as st
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.bag import Bag, Decoder, open_bag
from tf_tree_py.core import Pose, TransformException
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.recording.flight_recorder import (
    FlightRecorder,
    Happened,
    LOOKUP_FAILED,
    RecentMessages,
)

SECOND = 10**9
ASKED = Happened('asked', 'by a test')


class Robot:
    """Sends ten times a second into a buffer that a recorder observes."""

    def __init__(self, folder, **options):
        self.heard = []
        self.recorder = FlightRecorder(
            folder, last=2 * SECOND, notify=lambda *told: self.heard.append(told),
            **{'every': 10 * SECOND, **options})
        self.buffer = BufferCore()
        self.buffer.observers.add(self.recorder)

    def send(self, begin, end, edges=(('map', 'base'), ('base', 'base')), static=False):
        for tick in range(round((end - begin) * 10)):
            stamp = START + round(begin * SECOND) + tick * SECOND // 10
            batch = Batch(list(edges), [stamp] * len(edges), [pack_pose(*Pose())] * len(edges))
            self.buffer.observers.notify_received(
                ReceivedMessage(batch, stamp + 5_000_000, '/tf', static))
            self.buffer.insert_batch(batch, '', static, announced=True)


def test_bag_has_the_last_seconds_and_all_that_is_static(tmp_path):
    robot = Robot(tmp_path / 'new' / 'folder')
    robot.send(0.0, 0.1, [('base', 'lidar')], static=True)
    robot.send(0.0, 9.0)
    path = robot.recorder.write(ASKED)
    assert robot.heard == [(ASKED, path, '')]
    again = open_bag(path)
    assert {(edge.child, edge.static) for edge in again.edges()} == {
        ('base', False), ('lidar', True)}
    base, = (edge for edge in again.edges() if edge.child == 'base')
    assert (base.oldest, base.latest) == (START + 6_900_000_000, START + 8_900_000_000)


def test_what_a_program_inserts_by_hand_is_no_message(tmp_path):
    robot = Robot(tmp_path)
    robot.buffer.insert('map', 'base', START, Pose())
    assert robot.recorder.write(ASKED) is None


def test_refused_transforms_and_times_of_arrival_are_in_the_bag(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 1.0)
    with_self_edges = list(Bag(robot.recorder.write(ASKED)).arrivals())
    assert Decoder().read(with_self_edges[0]).edges == (('map', 'base'), ('base', 'base'))
    assert with_self_edges[0].received == START + 5_000_000


def test_what_happened_stands_beside_the_bag_and_in_it(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 1.0)
    path = robot.recorder.write(Happened('loop', 'a -> b', 5, ('a', 'b'), [{'code': 'loop'}]))
    assert path.name.endswith('_loop.mcap')
    story = json.loads(path.with_suffix('.json').read_text())
    assert story == {'why': 'loop', 'summary': 'a -> b', 'stamp': 5, 'frames': ['a', 'b'],
                     'findings': [{'code': 'loop'}], 'bag': path.name, 'messages': 10}
    assert b'a -> b' in path.read_bytes()


def test_at_most_one_in_a_while_and_so_many_files(tmp_path):
    robot = Robot(tmp_path, keep=2)
    paths = []
    for number in range(4):
        robot.send(number * 20.0, number * 20.0 + 1.0)
        paths.append(robot.recorder.write(ASKED))
        assert robot.recorder.write(ASKED) is None
        assert robot.heard[-1][2] == 'the last bag was written too recently'
    assert sorted(tmp_path.iterdir()) == sorted(
        each for path in paths[2:] for each in (path, path.with_suffix('.json')))


def test_jump_back_leaves_nothing_of_the_time_before(tmp_path):
    robot = Robot(tmp_path)
    robot.send(50.0, 51.0)
    robot.send(0.0, 1.0)
    base, = open_bag(robot.recorder.write(ASKED)).edges()
    assert base.latest == START + 900_000_000


@pytest.mark.parametrize('prepare, why_not', [
    (lambda robot, folder: None, 'no message has arrived'),
    (lambda robot, folder: (robot.send(0.0, 1.0), folder.write_text('')), 'File exists')])
def test_why_nothing_was_written_is_told(tmp_path, prepare, why_not):
    robot = Robot(tmp_path / 'folder')
    prepare(robot, tmp_path / 'folder')
    assert robot.recorder.write(ASKED) is None
    assert why_not in robot.heard[-1][2]


def test_first_lookup_that_fails_after_it_worked_writes_once(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 3.0)
    lookups = [('map', 'nowhere', START), ('map', 'base', START + SECOND),
               ('map', 'base', START + 60 * SECOND), ('map', 'base', START + 60 * SECOND)]
    for lookup in lookups:
        with suppress(TransformException):
            robot.buffer.lookup(*lookup)
    robot.recorder.close()
    (happened, path, _), = robot.heard
    assert (happened.why, happened.frames) == (LOOKUP_FAILED, ('map', 'base'))
    assert 'extrapolation into the future' in happened.summary
    assert open_bag(path).frames()


# --- the stored messages, and their limits

def arrival(edges, x=0.0, seconds=0.0, static=False, authority=''):
    stamp = START + round(seconds * SECOND)
    batch = Batch(edges, [stamp] * len(edges), [pack_pose(*Pose(x))] * len(edges))
    return ReceivedMessage(batch, stamp, '/tf', static, authority)


def test_known_static_is_renewed_however_many_there_are(tmp_path):
    recorder = FlightRecorder(tmp_path)
    for number in range(1_001):
        recorder.received(arrival([('base', f'frame{number}')], static=True))
    recorder.received(arrival([('base', 'frame0')], x=5.0, static=True))
    tree = open_bag(recorder.write(ASKED))
    assert tree.lookup('base', 'frame0').x == 5.0
    assert len(tree.frames()) == 1_002


def test_whoever_sends_most_loses_the_oldest_where_memory_is_used_up(tmp_path):
    recorder = FlightRecorder(tmp_path, most_bytes=100_000)
    recorder.received(arrival([('base', 'lidar')], static=True, authority='good'))
    for tick in range(1_000):
        recorder.received(arrival(
            [(f'{tick}' * 9, f'{tick}_{edge}') for edge in range(10)], 0.0, tick / 1000,
            tick % 3 == 0, 'evil'))
        if tick % 100 == 0:
            recorder.received(arrival([('map', 'base')], 1.0, tick / 1000, authority='good'))
    bag = open_bag(recorder.write(ASKED))
    assert {edge.child for edge in bag.edges()} >= {'lidar', 'base'}
    base, = (edge for edge in bag.edges() if edge.child == 'base')
    assert base.samples == 10
    assert '999_9' in bag.frames() and '500_0' not in bag.frames()


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(1, 5), st.booleans(),
                          st.integers(-1, 8)), max_size=60),
       # Two of the largest messages fit, so the sender with the most bytes has an older message.
       st.integers(4_000, 20_000))
def test_bytes_are_bounded_and_none_are_forgotten_or_counted_twice(sent, most):
    layouts = [[(f'{number}', f'{number}_{edge}') for edge in range(size)]
               for number, size in enumerate((1, 2, 3, 5))]
    kept = RecentMessages(3 * SECOND, most)
    for which, copies, static, seconds in sent:
        for _ in range(copies):
            kept.add(arrival(layouts[which], 0.0, seconds, static, f'robot{which % 2}'))
            assert kept.size <= most
    names = {id(one.batch.edges): one.batch.edges for one in kept.moving() + kept.static()}
    assert kept.size == sum(300 + 140 * len(one.batch.edges)
                            for one in kept.moving() + kept.static()) + sum(
        160 + len(parent) + len(child) for edges in names.values() for parent, child in edges)
    if sent and sent[-1][2]:
        assert kept.static()[-1].received == START + sent[-1][3] * SECOND


def test_message_that_was_kept_elsewhere_does_not_turn_the_clock_back(tmp_path):
    robot = Robot(tmp_path)
    robot.send(0.0, 1.0)
    robot.recorder.received(arrival([('map', 'other')])._replace(received=0))
    frames = open_bag(robot.recorder.write(ASKED)).frames()
    assert {'base', 'other'} <= set(frames)
