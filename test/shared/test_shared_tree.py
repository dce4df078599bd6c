# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Attaching to a shared tree, and what happens to its writer."""

from contextlib import contextmanager
import gc
import os
import pickle
import re
import resource
import signal
import subprocess
import sys
import threading

from conditions import until
from policies import HoldNewest
from programs import PATIENCE_S
import pytest
from sharing_trees import (
    error_of,
    files_of,
    new_place,
    shared,
    SharingBuffer,
    TESTS,
    WriterProcess,
)
from tf_tree_py import BufferCore, from_seconds, UNLIMITED
from tf_tree_py.shared import (
    attachment as attachment_module,
    layout,
    memory as memory_module,
    place as place_module,
)
from tf_tree_py.shared.attachment import Attachment
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import SharedTree
from tf_tree_py.shared.sharing import share

MS = 10 ** 6
HERE = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
TURNED = 1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8


@pytest.fixture
def domain_id():
    with new_place() as domain_id:
        yield domain_id


@pytest.fixture
def start(domain_id):
    started = []

    def start(x):
        started.append(WriterProcess(domain_id, x))
        return started[-1]

    yield start
    for writer in started:
        writer.close()


def test_without_a_writer_the_error_says_how_to_start_one(domain_id):
    for _ in range(2):
        with pytest.raises(SharedTreeException, match=(
                f'No process shares /tf and /tf_static of domain {domain_id}: .*tf_share')):
            SharedTree(domain_id=domain_id, wait_s=0.02)
        place = Place(domain_id)
        place.make_folder()
        place.lock.write_text('')  # left by a writer that is gone


def test_tree_of_another_process(domain_id, start):
    start(1.0)
    with SharedTree(domain_id=domain_id) as tree:
        assert tree.lookup('map', 'odom', MS) == TURNED
        assert tree.frames() == ['odom', 'map']


def test_reader_waits_for_a_writer(domain_id, start):
    waiting = threading.Thread(target=lambda: trees.append(
        SharedTree(domain_id=domain_id, wait_s=PATIENCE_S)))
    trees = []
    waiting.start()
    start(1.0)
    waiting.join()
    [tree] = trees
    with tree:
        until(lambda: tree.frames())
        assert tree.lookup('map', 'odom') == TURNED


def test_death_of_the_writer_is_known_and_the_next_one_is_joined(domain_id, start):
    first = start(1.0)
    with SharedTree(domain_id=domain_id) as tree:
        assert tree.lookup('map', 'odom') == TURNED
        first.close()
        until(lambda: error_of(lambda: tree.lookup('map', 'odom')))
        assert re.fullmatch(
            rf'The process {first.pid}, which shared .* of domain {domain_id}, has died: '
            r'its last sign of life was [0-9.]+ m?s ago\. To look up, start one with: .*',
            error_of(lambda: tree.lookup('map', 'odom')))
        assert error_of(tree.frames)
        start(5.0)
        until(lambda: not error_of(tree.frames))
        until(tree.frames)
        assert tree.lookup('map', 'odom')[0] == 5.0


def test_writer_of_another_version_is_not_taken_for_the_old_one(domain_id, start):
    """Each lookup raises the error, until there is one of this version."""
    first = start(1.0)
    with SharedTree(domain_id=domain_id) as tree:
        first.close()
        with another_version(), share(SharingBuffer(), Place(domain_id)):
            until(lambda: 'not a tree of this version' in error_of(tree.frames))
            for _ in range(3):
                assert 'not a tree of this version' in error_of(tree.frames)
        start(5.0)
        until(lambda: not error_of(tree.frames))
        until(tree.frames)
        assert tree.lookup('map', 'odom')[0] == 5.0


@contextmanager
def another_version():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(memory_module, 'MAGIC', layout.MAGIC + 1)
        yield


def test_next_writer_that_has_not_begun_is_not_taken_for_the_old_one(domain_id, start):
    first = start(1.0)
    place = Place(domain_id)
    with SharedTree(domain_id=domain_id) as tree:
        first.close()
        held = place_module.hold(place)
        memory = memory_module.Memory(place.memory)
        until(lambda: error_of(tree.frames))
        assert 'has died' in error_of(tree.frames)
        assert error_of(lambda: SharedTree(domain_id=domain_id)).startswith('No process shares')
        memory.forget()
        os.close(held)


def test_sign_of_life_from_the_future_is_none(domain_id, start):
    """As of a container with another clock."""
    first = start(1.0)
    with SharedTree(domain_id=domain_id) as tree:
        with Place(domain_id).memory.open('r+b') as file:
            first.signal(signal.SIGSTOP)
            file.seek(layout.BEAT * layout.WORD)
            file.write((2 ** 62).to_bytes(8, 'little'))
            first.close()
        until(lambda: error_of(tree.frames))
        assert 'has died' in error_of(tree.frames)


def test_removed_file_ends_sharing():
    buffer = SharingBuffer()
    with shared(buffer) as (domain_id, sharing), SharedTree(domain_id=domain_id) as tree:
        Place(domain_id).memory.unlink()
        assert sharing.over.wait(PATIENCE_S)
        assert sharing.why == 'its file was removed'
        until(lambda: error_of(tree.frames))


def test_silence_of_a_dead_writer_is_believed_for_a_quarter_of_a_second(
        domain_id, start, monkeypatch):
    writer = start(1.0)
    attachment = Attachment(Place(domain_id))
    writer.close()
    now = attachment.words[layout.BEAT] + 249 * MS
    monkeypatch.setattr(attachment_module.time, 'monotonic_ns', lambda: now)
    assert error_of(attachment.check) == ''
    now += 2 * MS
    assert 'has died: its last sign of life was 251' in error_of(attachment.check)
    attachment.close()


def test_writer_that_is_stopped_is_not_believed_until_it_goes_on(domain_id, start):
    writer = start(1.0)
    with SharedTree(domain_id=domain_id) as tree:
        assert tree.lookup('map', 'odom') == TURNED
        writer.signal(signal.SIGSTOP)
        until(lambda: error_of(lambda: tree.lookup('map', 'odom')))
        assert re.search(r'has been stopped by a signal .*: its last sign of life was .* ago.*'
                         rf'kill -CONT {writer.pid}', error_of(tree.frames))
        writer.signal(signal.SIGCONT)
        until(lambda: not error_of(tree.frames))
        assert tree.lookup('map', 'odom') == TURNED


def test_writer_that_lives_but_does_not_run(domain_id, start):
    """Neither stopped nor dead: two causes, and the error names both."""
    writer = start(1.0)
    with SharedTree(domain_id=domain_id) as tree:
        writer.hang()
        until(lambda: error_of(tree.frames))
        assert re.search('lives, but does not run: its last sign of life was [0-9.]+ s ago. It '
                         'hangs, or the machine is overloaded', error_of(tree.frames))


def test_writer_that_begins_while_a_reader_looks_has_not_died(domain_id, monkeypatch):
    place, opened, begun = Place(domain_id), attachment_module.opened, []
    place.make_folder()
    place.lock.write_text('')  # left by a writer that is gone

    def begin_first(path, *arguments):
        if path == place.memory and not begun:
            begun.append(share(SharingBuffer(), place))
        return opened(path, *arguments)

    monkeypatch.setattr(attachment_module, 'opened', begin_first)
    with SharedTree(domain_id=domain_id) as tree:
        assert tree.frames() == []
    begun[0].close()


def test_reason_of_the_end_is_known(domain_id):
    with share(SharingBuffer(), Place(domain_id)) as sharing:
        tree = SharedTree(domain_id=domain_id)
        sharing.close('the café is closing')
        until(lambda: error_of(tree.frames))
        assert error_of(tree.frames).startswith(
            f'The process {os.getpid()}, which shared /tf and /tf_static of domain {domain_id}, '
            'has ended: the café is closing.')
    tree.close()
    assert error_of(lambda: SharedTree(domain_id=domain_id)).startswith('No process shares')


def test_second_writer_is_refused_and_others_topics_are_another_tree(domain_id, start):
    writer = start(1.0)
    with pytest.raises(SharedTreeException, match=(
            rf'process {writer.pid} already shares /tf and /tf_static of domain '
            f'{domain_id}, and only one can')):
        share(SharingBuffer(), Place(domain_id))
    topics = ['/robot1/tf', '/robot1/tf_static']
    with share(SharingBuffer(), Place(domain_id, topics)):
        with SharedTree(domain_id=domain_id, topics=topics) as other:
            assert other.frames() == []
        assert error_of(lambda: SharedTree(domain_id=domain_id + 1, topics=topics))


def test_buffer_goes_on_alone_after_the_end():
    buffer, model = SharingBuffer(from_seconds(1.0)), BufferCore(from_seconds(1.0))
    with shared(buffer) as (domain_id, sharing):
        for number in range(3_000):
            if number == 1_500:
                sharing.close()
            for each in (buffer, model):
                each.insert('map', 'odom', number * MS, (float(number), *HERE[1:]))
    assert buffer.stamps_of('odom').tolist() == model.stamps_of('odom').tolist()
    assert buffer.lookup('map', 'odom', 2_700 * MS) == model.lookup('map', 'odom', 2_700 * MS)


def test_nothing_can_be_changed_from_outside():
    buffer = SharingBuffer()
    buffer.insert('map', 'odom', MS, HERE)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        for change in (
                lambda: tree.insert('map', 'odom', 2 * MS, HERE),
                lambda: tree.insert('map', 'new', 2 * MS, HERE, static=True),
                lambda: tree.insert_many([('map', 'odom', 2 * MS, HERE)] * 2),
                lambda: tree.insert_track('map', 'odom', [2 * MS], [HERE]),
                lambda: tree.clear(), lambda: tree.start_anew('why'),
                lambda: tree.remove_frame('odom'),
                lambda: tree.correct('odom', HERE)):
            with pytest.raises(SharedTreeException, match='cannot be changed here'):
                change()
        with pytest.raises(TypeError):  # the memory is mapped for reading only
            tree.attachment.memory[0] = 0
        assert tree.edges() == buffer.edges()


def test_closed_tree():
    buffer = SharingBuffer()
    with shared(buffer) as (domain_id, _):
        tree = SharedTree(domain_id=domain_id)
        tree.close()
        tree.close()
        with pytest.raises(SharedTreeException, match='has been closed'):
            tree.frames()


def test_snapshot_outlives_the_writer_and_can_be_sent():
    buffer = SharingBuffer()
    buffer.insert('map', 'odom', MS, TURNED)
    buffer.insert('odom', 'base', MS, TURNED, static=True)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        snapshot = tree.snapshot()
        with pytest.raises(TypeError, match='pickle its snapshot'):
            pickle.dumps(tree)
    assert snapshot.lookup('map', 'base') == buffer.lookup('map', 'base')
    assert pickle.loads(pickle.dumps(snapshot)).edges() == buffer.edges()


# --- what cannot be shared

@pytest.mark.parametrize('change', [
    lambda buffer: buffer.correct('odom', TURNED),
    lambda buffer: buffer.set_interpolation('odom', HoldNewest(MS)),
    lambda buffer: buffer.set_interpolation('new', HoldNewest(MS))])
def test_tree_that_cannot_be_shared_leaves_nothing(change, domain_id):
    gc.collect()
    buffer, descriptors = SharingBuffer(), os.listdir('/proc/self/fd')
    buffer.insert('map', 'odom', MS, HERE)
    change(buffer)
    for _ in range(3):
        with pytest.raises(SharedTreeException, match='cannot be shared'):
            share(buffer, Place(domain_id))
    assert files_of(Place(domain_id)) == [Place(domain_id).lock]
    gc.collect()
    assert len(os.listdir('/proc/self/fd')) == len(descriptors)


def test_unlimited_history_cannot_be_shared(domain_id):
    with pytest.raises(SharedTreeException, match='cache time'):
        share(SharingBuffer(UNLIMITED), Place(domain_id))


def test_edge_of_another_kind_cannot_be_shared():
    buffer = SharingBuffer()
    buffer.insert('map', 'odom', MS, HERE)
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        buffer.correct('odom', TURNED)
        assert buffer.lookup('map', 'odom')
        until(lambda: error_of(tree.frames))
        assert 'CorrectedSamples cannot be shared' in error_of(tree.frames)


@pytest.mark.parametrize(('system', 'machine', 'why'), [
    ('darwin', 'arm64', 'on Linux only'), ('linux', 'riscv64', 'cannot be shared on riscv64')])
def test_other_machines_are_refused(system, machine, why, monkeypatch):
    monkeypatch.setattr(layout.sys, 'platform', system)
    monkeypatch.setattr(layout.platform, 'machine', lambda: machine)
    with pytest.raises(SharedTreeException, match=why):
        SharedTree()


def test_folder_that_others_can_write_to_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(place_module, 'SHARED_MEMORY', tmp_path)
    place = Place(1)
    place.make_folder()
    assert place.memory.parent.stat().st_mode & 0o777 == 0o700
    for mode in (0o770, 0o707):
        place.memory.parent.chmod(mode)
        for attempt in (lambda: SharedTree(domain_id=1), lambda: share(SharingBuffer(), place)):
            with pytest.raises(SharedTreeException, match='not a folder that only this user can'):
                attempt()
    place.memory.parent.rmdir()
    place.memory.parent.symlink_to(tmp_path)
    with pytest.raises(SharedTreeException, match='not a folder that only this user can'):
        SharedTree(domain_id=1)


def test_symbolic_links_are_not_followed(domain_id, tmp_path):
    place = Place(domain_id)
    place.make_folder()
    (tmp_path / 'other').write_text('')
    place.lock.symlink_to(tmp_path / 'other')
    for attempt in (lambda: SharedTree(domain_id=domain_id),
                    lambda: share(SharingBuffer(), place)):
        with pytest.raises(SharedTreeException, match='cannot be opened'):
            attempt()


@pytest.fixture
def small_files():
    """Limit the size of files, as a full file system does, with another error."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    def limit(size):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))

    yield limit
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def test_full_memory_ends_sharing_with_the_reason(small_files):
    buffer = SharingBuffer()
    with shared(buffer) as (domain_id, sharing), SharedTree(domain_id=domain_id) as tree:
        small_files(1_000_000)
        for number in range(1, 30_000):
            buffer.insert('map', 'odom', number * MS // 10, (float(number), *HERE[1:]))
        # Nothing is lost in the process itself.
        assert len(buffer.stamps_of('odom')) == number
        assert buffer.lookup('map', 'odom', MS) == (10.0, *HERE[1:])
        assert sharing.over.is_set()
        small_files(resource.getrlimit(resource.RLIMIT_FSIZE)[1])
        until(lambda: error_of(tree.frames))
        assert re.search('has ended: there is no memory left .*the tree needs more than 1 MB in '
                         '/dev/shm, so make that larger .* or the cache time shorter',
                         error_of(tree.frames))


def test_memory_that_is_full_at_once(domain_id, small_files):
    small_files(1_000)
    with pytest.raises(SharedTreeException, match='no memory left'):
        share(SharingBuffer(), Place(domain_id))
    small_files(resource.getrlimit(resource.RLIMIT_FSIZE)[1])
    with share(SharingBuffer(), Place(domain_id)):
        pass


# --- processes and threads

FORKS = """
import multiprocessing, os, sys
from sharing_trees import SharingBuffer
from tf_tree_py.shared.place import Place
from tf_tree_py.shared.shared_tree import SharedTree
from tf_tree_py.shared.sharing import share
from tf_tree_py.shared.errors import SharedTreeException

def look(pipe):
    with SharedTree(domain_id=int(sys.argv[1])) as mine:
        pipe.send((tree.lookup('map', 'odom'), mine.lookup('map', 'odom')))

def write_alone(pipe):
    for number in range(2, 2_000):
        buffer.insert('map', 'odom', 1_000_000 * number, (9.0, 0, 0, 0, 0, 0, 1))
    pipe.send(buffer.lookup('map', 'odom'))

def in_child(run):
    mine, its = multiprocessing.Pipe()
    child = multiprocessing.get_context('fork').Process(target=run, args=(its,))
    child.start()
    print(*mine.recv(), flush=True)
    child.join()

buffer = SharingBuffer()
sharing = share(buffer, Place(int(sys.argv[1])))
buffer.insert('map', 'odom', 1_000_000, (1.0, 0, 0, 0, 0, 0, 1))
tree = SharedTree(domain_id=int(sys.argv[1]))
in_child(write_alone)
in_child(look)
buffer.insert('map', 'odom', 2_000_000, (3.0, 0, 0, 0, 0, 0, 1))
print(tree.lookup('map', 'odom'), len(tree.stamps_of('odom')), flush=True)
if os.fork() == 0:  # a child that outlives the writer does not write
    os.read(0, 1)
    os._exit(0)
print('forked', flush=True)
os.kill(os.getpid(), 9)
"""


def test_forked_processes(domain_id):
    """Children read, and change only their own copies; the writer's death is its own."""
    process = subprocess.Popen(
        [sys.executable, '-c', FORKS, str(domain_id)], stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, text=True,
        env={**os.environ, 'PYTHONPATH': TESTS})
    place = '({}, 0.000, 0.000) m, rpy (0.00, 0.00, 0.00) deg'.format
    lines = [process.stdout.readline().strip() for _ in range(4)]
    assert process.wait() == -signal.SIGKILL
    assert 'forked' in lines
    alone, read, after = lines[:3]
    assert alone.split() == ['9.0', '0.0', '0.0', '0.0', '0.0', '0.0', '1.0']
    assert read == f'{place("1.000")} {place("1.000")}'
    assert after == f'{place("3.000")} 2'
    # As soon as the child has begun.
    until(lambda: 'has died' in error_of(lambda: SharedTree(domain_id=domain_id)))
    process.communicate()


def test_threads_of_readers_beside_a_writer():
    """Every answer is that of a state that existed."""
    buffer = SharingBuffer(from_seconds(100.0))
    over, wrong, looks = threading.Event(), [], []

    def insert_at(stamp, *children):
        parents = {'odom': 'map', 'base': 'odom'}
        buffer.insert_many([(parents[child], child, stamp, (stamp / MS, *TURNED[1:]))
                            for child in children])

    insert_at(MS, 'odom', 'base')
    with shared(buffer) as (domain_id, _), SharedTree(domain_id=domain_id) as tree:
        def read():
            count = 0
            while not over.is_set() or not count:
                stamp, pose = tree.lookup_stamped('map', 'odom')
                through = tree.lookup('odom', 'base', stamp)
                if pose[0] != stamp / MS or through[0] != stamp / MS:
                    wrong.append((stamp, pose, through))
                count += 1
            looks.append(count)

        readers = [threading.Thread(target=read) for _ in range(3)]
        for reader in readers:
            reader.start()
        for number in range(2, 3_000):
            insert_at(number * MS, 'odom', 'base')
            if number % 50 == 0:  # late
                insert_at((number - 1) * MS + 1, 'odom')
        over.set()
        for reader in readers:
            reader.join()
    assert not wrong
    assert len(looks) == len(readers)
