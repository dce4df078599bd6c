# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Memory that is used again while somebody reads it, or between two looks."""

import threading

import numpy as np
import pytest
from sharing_trees import shared, SharingBuffer
from tf_tree_py import BufferCore, from_seconds, Pose
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.sample import Batch, Edges
from tf_tree_py.shared import mirror as mirror_module
from tf_tree_py.shared.attachment import Attachment
from tf_tree_py.shared.errors import LapsedException, SharedTreeException
from tf_tree_py.shared.layout import INTACT, RECORDS
from tf_tree_py.shared.memory import Memory
from tf_tree_py.shared.mirror import Mirror
from tf_tree_py.shared.mirror_tree import MirrorTree
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import SharedTree

CACHE_TIME = from_seconds(10.0)
MS = 10 ** 6
SAMPLES = 2_000


def pose_of(stamp):
    return float(stamp // MS), 0.0, 0.0, 0.0, 0.0, 0.6, 0.8


class Writer:
    """Changes a tree such that its memory is used again; each edge goes by its stamps."""

    def __init__(self):
        self.buffer = SharingBuffer(CACHE_TIME)
        self.first = 0

    def fill(self):
        """Insert a window of samples, at even milliseconds."""
        stamps = [(2 * number + 2) * MS for number in range(SAMPLES)]
        for child in ('a', 'b'):
            self.buffer.insert_track('map', child, stamps, [pose_of(stamp) for stamp in stamps])

    def insert_late(self, child='a'):
        """Insert a sample between others, so that all of them get another block."""
        stamp = 2 * SAMPLES * MS - 1 - self.first
        self.first += 1
        self.buffer.insert('map', child, stamp, pose_of(stamp))

    def use_memory_again(self, words, state):
        """Insert until memory that a state refers to is used again, and overwritten."""
        for _ in range(1_000):
            if words[INTACT] > state:
                break
            self.insert_late()
        self.insert_late()
        assert words[INTACT] > state


@pytest.fixture(autouse=True)
def no_time(monkeypatch):
    """Let memory be used again at once."""
    monkeypatch.setattr(Memory, 'keep_s', 0.0)


@pytest.fixture
def writer():
    writer = Writer()
    with shared(writer.buffer) as (writer.domain_id, writer.sharing):
        writer.fill()
        yield writer


@pytest.fixture
def reading(writer):
    """Return the lock of a tree that shows the writer's, its tree, and the words of the header."""
    tree = MirrorTree(0, 1_000, 1_000)
    attachment = Attachment(Place(writer.domain_id))
    mirror = Mirror(attachment, tree, threading.RLock())
    yield mirror, tree, attachment.words
    attachment.close()


def number_of(words):
    return words[mirror_module.STATE] >> 16


def test_release_of_the_lock_says_that_memory_was_used_again(writer, reading):
    mirror, tree, words = reading
    with pytest.raises(LapsedException, match='stopped'), mirror:
        writer.use_memory_again(words, number_of(words))
    with mirror:
        assert tree.histories['b'].sample(10 * MS) == pose_of(10 * MS)


def test_error_of_a_lookup_in_such_memory_is_not_believed(writer, reading):
    mirror, _, words = reading
    with pytest.raises(LapsedException), mirror:
        writer.use_memory_again(words, number_of(words))
        raise IndexError('a code without a name')


def test_inner_hold_keeps_the_state_of_the_outer_one(writer, reading):
    mirror, tree, _ = reading
    with mirror:
        before = len(tree.histories['a'])
        writer.insert_late()
        with mirror:
            assert len(tree.histories['a']) == before
    with mirror:
        assert len(tree.histories['a']) == before + 1


def test_hold_that_a_keyboard_interrupt_left_ends_by_itself(writer, reading, monkeypatch):
    mirror, tree, _ = reading
    mirror.__enter__()
    before = len(tree.histories['a'])
    writer.insert_late()
    later = mirror_module.monotonic_ns() + 2 * 10 ** 9
    with mirror:
        assert len(tree.histories['a']) == before
    monkeypatch.setattr(mirror_module, 'monotonic_ns', lambda: later)
    with pytest.raises(LapsedException), mirror:
        pytest.fail('this state is old')
    with pytest.raises(LapsedException), mirror:  # it may be in a hold that was given up
        pass
    with mirror:
        assert len(tree.histories['a']) == before + 1


def test_reader_that_is_stopped_between_two_holds(writer, reading, monkeypatch):
    """The inner one shows the newest state, and what the outer one read before is not believed."""
    mirror, tree, words = reading
    later = mirror_module.monotonic_ns() + 2 * 10 ** 9
    with pytest.raises(LapsedException), mirror:
        writer.use_memory_again(words, number_of(words))
        monkeypatch.setattr(mirror_module, 'monotonic_ns', lambda: later)
        with mirror:
            pytest.fail('it has been used again')
    with mirror:
        before = len(tree.histories['a'])
        assert before == len(writer.buffer.stamps_of('a'))
    writer.insert_late()
    with mirror:
        assert len(tree.histories['a']) == before + 1


def test_interrupt_is_not_replaced(writer, reading):
    mirror, _, words = reading
    with pytest.raises(KeyboardInterrupt), mirror:
        writer.use_memory_again(words, number_of(words))
        raise KeyboardInterrupt


class Meddling(str):
    """The name of a frame; a lookup of it calls a function first."""

    __slots__ = ('meanwhile',)

    def __hash__(self):
        meanwhile, self.meanwhile = self.meanwhile, None
        if meanwhile:
            meanwhile()
        return hash(str(self))

    def __eq__(self, other):
        return str(self) == other


@pytest.mark.parametrize('ask', [
    lambda tree, frame: tree.lookup('map', frame, 10 * MS),
    lambda tree, frame: tree.lookup('map', frame),
    lambda tree, frame: tree.lookup_at('map', frame, 10 * MS),
    lambda tree, frame: tree.lookup_full('map', 10 * MS, frame, 12 * MS, 'map'),
    lambda tree, frame: tree.lookup_many('map', frame, [10 * MS, 13 * MS]).translation.tolist(),
    lambda tree, frame: tree.lookup_tree(frame, 10 * MS),
    lambda tree, frame: tree.latest_common_time('map', frame),
    lambda tree, frame: tree.frames_between('map', frame, 10 * MS),
    lambda tree, frame: tree.edges_between('map', frame, 10 * MS),
    lambda tree, frame: tree.stamps_of(frame).tolist(),
    lambda tree, frame: tree.samples_around(frame, 11 * MS),
    lambda tree, frame: tree.predict('map', frame, 4_010 * MS, 100 * MS).pose,
])
def test_every_lookup_in_memory_that_is_used_again_is_made_again(ask, writer):
    with SharedTree(domain_id=writer.domain_id) as tree:
        frame = Meddling('b')
        words = tree.attachment.words
        asked = []

        def meanwhile():
            asked.append(frame)
            for child in ('b', 'a'):  # that block is retired now
                writer.insert_late(child)
            writer.use_memory_again(words, number_of(words))

        frame.meanwhile = meanwhile
        answer = ask(tree, frame)
        assert asked
        frame.meanwhile = None
        assert answer == ask(writer.buffer, frame)


def test_error_says_that_a_process_was_stopped_in_all_attempts(writer):
    with SharedTree(domain_id=writer.domain_id) as tree:
        words = tree.attachment.words
        frame = Meddling('b')

        def meanwhile():
            frame.meanwhile = meanwhile
            writer.use_memory_again(words, number_of(words))

        frame.meanwhile = meanwhile
        with pytest.raises(SharedTreeException, match='ask again'):
            tree.lookup('map', frame, 10 * MS)


def test_another_block_at_the_same_place_is_another_block(writer):
    """A reader that looks rarely finds its block used again, for the same edge."""
    with SharedTree(domain_id=writer.domain_id) as tree:
        seen = set()
        for number in range(60):
            writer.insert_late()
            if number % 2:
                continue
            edge = writer.buffer.edges()[0]
            seen.add(edge.samples)
            assert tree.edges() == writer.buffer.edges()
            assert tree.stamps_of('a').tolist() == writer.buffer.stamps_of('a').tolist()
        assert len(seen) == 30


def test_state_that_is_overwritten_while_it_is_copied_is_not_shown(writer, monkeypatch):
    """After so many states, the record of the first is that of another."""
    with SharedTree(domain_id=writer.domain_id) as tree:
        stamp = 2 * SAMPLES * MS
        counts = iter(range(RECORDS, RECORDS - 6, -1))

        def fence():
            """Run between the parts of a copy."""
            for _ in range(next(counts, 0)):
                insert()

        def insert():
            nonlocal stamp
            stamp += 2 * MS
            writer.buffer.insert('map', 'a', stamp, pose_of(stamp))

        insert()
        monkeypatch.setattr(mirror_module, 'ORDERED', True)  # so that it is called nowhere else
        monkeypatch.setattr(mirror_module, 'fence', fence)
        assert tree.lookup('map', 'a') == pose_of(stamp)
        assert next(counts, None) is None


def test_tree_that_always_changes_meanwhile_cannot_be_read(writer, monkeypatch):
    with SharedTree(domain_id=writer.domain_id) as tree:
        def fence():
            for _ in range(RECORDS):
                writer.insert_late()

        writer.insert_late()
        monkeypatch.setattr(mirror_module, 'fence', fence)
        monkeypatch.setattr(Mirror, 'attempts', 3)
        with pytest.raises(SharedTreeException, match='changed during each of 3 attempts'):
            tree.lookup('map', 'a')


def test_memory_of_edges_that_come_and_go_is_used_again(writer):
    with SharedTree(domain_id=writer.domain_id) as tree:
        sizes = []
        for number in range(400):
            # A new parent, and a new name in the directory.
            writer.buffer.insert(f'parent {number % 7}', 'b', (5_000 + number) * MS, pose_of(MS))
            writer.buffer.remove_frame(f'c{number - 1}')
            writer.buffer.insert_track('map', f'c{number}', [MS, 2 * MS], [pose_of(MS)] * 2)
            assert tree.frames() == writer.buffer.frames()
            sizes.append(tree.attachment.size())
        assert sizes[-1] == sizes[100]


def test_sample_that_is_refused_ends_the_window_at_the_newest():
    """As in tf2; before it, the window ends at the sample before the newest."""
    buffer, second = SharingBuffer(CACHE_TIME), from_seconds(1.0)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        for stamp, expected in ((1.0, [1.0]), (10.5, [1.0, 10.5]), (11.5, [1.0, 10.5, 11.5]),
                                (0.2, [10.5, 11.5]), (11.6, [10.5, 11.5, 11.6])):
            buffer.insert('map', 'odom', int(stamp * second), pose_of(MS), strict=False)
            assert (tree.stamps_of('odom') / second).tolist() == expected
        with SharedTree(domain_id=domain_id) as late:
            assert late.stamps_of('odom').tolist() == tree.stamps_of('odom').tolist()


def test_prediction_notices_late_samples():
    """A prediction keeps what it learnt from earlier samples; a snapshot has never predicted."""
    rng, buffer = np.random.default_rng(1), SharingBuffer(from_seconds(20.0))
    step = 400 * MS
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        late = []
        for stamp in range(step, 200 * step, step):
            pose = Pose.from_xyz_rpy(x=np.sin(stamp / 1e9) ** 3, yaw=rng.normal(scale=0.01))
            if len(late) < 2 and rng.random() < 0.1:
                late.append((stamp, pose))
                continue
            buffer.insert('odom', 'base', stamp, pose)
            if len(late) == 2:
                for each in late:
                    buffer.insert('odom', 'base', *each)
                late = []
            if stamp > 10 * step:
                asked = 'odom', 'base', stamp + 65_536_000, 10 ** 9
                np.testing.assert_allclose(
                    tree.predict(*asked).covariance, buffer.snapshot().predict(*asked).covariance,
                    rtol=1e-9, atol=1e-18)


def test_batches_fill_block_after_block_and_the_file_stays_small():
    """Ten windows of forty edges: memory is used again, and at most 1.5 windows are needed."""
    edges = Edges([(f'f{number}', f'f{number + 1}') for number in range(40)])
    samples, interval = 1_600, CACHE_TIME // 1_600
    model, buffer = BufferCore(CACHE_TIME), SharingBuffer(CACHE_TIME)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        sizes = []
        for number in range(1, 10 * samples):
            stamp = number * interval
            batch = Batch(edges, [stamp] * 40, [pack_pose(*pose_of(stamp))] * 40)
            model.insert_batch(batch)
            buffer.insert_batch(batch)
            if number % 99 == 0:
                assert tree.lookup('f0', 'f40') == model.lookup('f0', 'f40')
                assert tree.lookup_tree('f0', stamp - CACHE_TIME // 2) == model.lookup_tree(
                    'f0', stamp - CACHE_TIME // 2)
                sizes.append(tree.attachment.size())
        assert sizes[-1] == sizes[len(sizes) // 3]
        assert sizes[-1] < 1.5 * len(edges) * samples * 64
