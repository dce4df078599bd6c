# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waiting for data that another process receives."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
import signal
import subprocess
import sys
import threading

from conditions import until
from effort import examples
from hypothesis.stateful import invariant
from programs import PATIENCE_S
import pytest
from sharing_trees import new_place, shared, SharingBuffer, WriterProcess
from tf_tree_py import TransformException
from tf_tree_py.core import ClockJumpException
from tf_tree_py.core.buffer.waiting import Inquiry
from tf_tree_py.shared.errors import SharedTreeException
from tf_tree_py.shared.futex import Futex
from tf_tree_py.shared.shared_tree import SharedTree
from tf_tree_py.shared.waiting import SharedWaiting
from waits_machine import CACHE_TIME, WaitsMachine

MS = 10 ** 6
TURNED = 1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8


@pytest.fixture
def pair():
    """Return a buffer, and a tree that shows it."""
    buffer = SharingBuffer(now=lambda: 0)
    buffer.insert('map', 'odom', MS, TURNED)
    with shared(buffer) as (domain_id, sharing), SharedTree(domain_id=domain_id) as tree:
        tree.sharing, tree.domain_id = sharing, domain_id
        yield buffer, tree


@pytest.fixture
def wait():
    """Return a function that begins a wait, and returns its future when it sleeps."""
    with ThreadPoolExecutor() as threads:
        def wait(tree, *arguments):
            before = len(tree.waiting)
            future = threads.submit(tree.lookup_within, 3.0, *arguments)
            until(lambda: len(tree.waiting) > before or future.done())
            return future

        yield wait


def test_wait_ends_when_the_data_arrives(pair, wait):
    buffer, tree = pair
    future = wait(tree, 'map', 'odom', 2 * MS)
    buffer.insert('map', 'base', 2 * MS, TURNED)
    assert not future.done()
    buffer.insert('map', 'odom', 3 * MS, TURNED)
    assert future.result() == TURNED
    assert len(tree.waiting) == 0


def test_wait_for_a_frame_ends_when_it_appears(pair, wait):
    buffer, tree = pair
    future = wait(tree, 'map', 'new')
    buffer.insert('map', 'new', 0, TURNED, static=True)
    assert future.result() == TURNED


def test_data_that_another_thread_has_already_seen_wakes_those_that_wait(pair, wait):
    """The thread of the waits finds nothing new then."""
    buffer, tree = pair
    futures = [wait(tree, 'map', 'odom', 2 * MS), wait(tree, 'map', 'new')]
    with tree.waiting.lock:  # so that thread is not the first
        buffer.insert('map', 'new', 0, TURNED, static=True)
        buffer.insert('map', 'odom', 3 * MS, TURNED)
        assert 'new' in tree.frames()
        assert len(tree.waiting) == 2
    assert [future.result() for future in futures] == [TURNED, TURNED]


def test_wait_ends_at_its_timeout(pair):
    _, tree = pair
    with pytest.raises(TransformException, match='waited 0.0[12]') as error:
        tree.lookup_within(0.01, 'map', 'odom', 2 * MS)
    assert error.value.latest == MS


def test_restart_of_time_ends_waits_and_those_that_begin_later_go_on(pair, wait):
    buffer, tree = pair
    for number in range(2):
        future = wait(tree, 'map', 'odom', 20 * MS)
        buffer.start_anew(f'bag {number} began')
        with pytest.raises(ClockJumpException, match=f'During the wait bag {number} began'):
            future.result()
        buffer.insert('map', 'odom', MS, TURNED)
    later = wait(tree, 'map', 'odom', 20 * MS)
    buffer.clear()
    buffer.insert('map', 'odom', 21 * MS, TURNED)
    buffer.insert('map', 'odom', 19 * MS, TURNED)
    assert later.result() == TURNED


def test_end_of_sharing_ends_waits(pair, wait):
    _, tree = pair
    future = wait(tree, 'map', 'odom', 2 * MS)
    tree.sharing.close('it is late')
    with pytest.raises(SharedTreeException, match=r'has ended: it is late\..* \(waited [0-9.]+ s'):
        future.result()


def test_close_ends_waits(pair, wait):
    _, tree = pair
    future = wait(tree, 'map', 'odom', 2 * MS)
    tree.close()
    with pytest.raises(SharedTreeException, match='has been closed'):
        future.result()


@pytest.mark.parametrize(('number', 'why'), [
    (signal.SIGKILL, 'has died'), (signal.SIGSTOP, 'has been stopped by a signal')],
    ids=['killed', 'stopped'])
def test_death_of_the_writer_ends_waits(number, why, wait):
    with (new_place() as domain_id, WriterProcess(domain_id) as writer,
          SharedTree(domain_id=domain_id) as tree):
        until(lambda: tree.frames())
        future = wait(tree, 'map', 'odom', 2 * MS)
        writer.signal(number)
        with pytest.raises(SharedTreeException, match=f'process {writer.pid}, .*{why}'):
            future.result()
        with pytest.raises(SharedTreeException, match=why):
            tree.lookup_within(PATIENCE_S, 'map', 'odom', 2 * MS)


def test_callback_that_raises_does_not_keep_the_others_asleep(pair, wait, monkeypatch):
    buffer, tree = pair
    raised, hooked = threading.Event(), []

    def callback():
        raised.set()
        raise ZeroDivisionError

    monkeypatch.setattr(threading, 'excepthook', lambda error: hooked.append(error.exc_type))
    first = Inquiry(tree.waiting, lambda: tree.lookup('map', 'odom', 2 * MS), callback)
    first.ask()
    future = wait(tree, 'map', 'odom', 2 * MS)
    buffer.insert('map', 'odom', 3 * MS, TURNED)
    assert future.result() == TURNED
    assert raised.wait(PATIENCE_S)
    later = wait(tree, 'map', 'odom', 4 * MS)
    buffer.insert('map', 'odom', 5 * MS, TURNED)
    assert later.result() == TURNED
    assert hooked == [ZeroDivisionError]


def test_callback_that_raises_when_the_writer_dies_does_not_stop_the_thread(wait, monkeypatch):
    monkeypatch.setattr(threading, 'excepthook', lambda _: None)
    with new_place() as domain_id:
        with WriterProcess(domain_id) as writer:
            tree = SharedTree(domain_id=domain_id, wait_s=PATIENCE_S)
            until(lambda: tree.frames())
            Inquiry(
                tree.waiting, lambda: tree.lookup('map', 'odom', 2 * MS), lambda: 1 / 0).ask()
            writer.signal(signal.SIGKILL)
            until(lambda: not len(tree.waiting))
        with tree, WriterProcess(domain_id) as writer:
            until(lambda: not failing(tree.frames))
            until(lambda: tree.frames())
            future = wait(tree, 'map', 'odom', 2 * MS)
            writer.signal(signal.SIGKILL)
            with pytest.raises(SharedTreeException, match=f'process {writer.pid}, .* has died'):
                future.result()


def failing(ask):
    try:
        ask()
    except SharedTreeException:
        return True
    return False


def test_thread_ends_with_the_waits_and_begins_with_the_next(pair, wait, monkeypatch):
    monkeypatch.setattr(SharedWaiting, 'stay_s', 0.01)
    buffer, tree = pair

    def threads():
        return [each for each in threading.enumerate() if each.name == 'tf_tree_py waits']

    until(lambda: not threads())
    tree.lookup('map', 'odom')
    assert not threads()
    for number in range(1, 3):
        future = wait(tree, 'map', 'odom', 2 * number * MS)
        until(lambda: len(threads()) == 1)
        buffer.insert('map', 'odom', 2 * number * MS, TURNED)
        future.result()
        until(lambda: not threads())


def test_system_without_the_call_is_asked_again_and_again(pair, wait, monkeypatch):
    """As where a container does not allow it."""
    monkeypatch.setattr(Futex, 'number', 100_000)
    buffer, tree = pair
    future = wait(tree, 'map', 'odom', 2 * MS)
    buffer.insert('map', 'odom', 3 * MS, TURNED)
    assert future.result() == TURNED


WAITS = """
import os, sys
from tf_tree_py.shared.shared_tree import SharedTree
tree = SharedTree(domain_id=int(sys.argv[1]), wait_s=60)
for child in range(int(sys.argv[2])):  # a thread waits already where this process forks
    if os.fork() == 0:
        break
    if child == 0:
        try:
            tree.lookup_within(0.01, 'map', 'odom', 2_000_000)
        except Exception:
            pass
os.write(1, b'asks\\n')
os.write(1, b'answered %d\\n' % tree.lookup_within(60, 'map', 'odom', 2_000_000).x)
"""


def test_forked_processes_wait_each_for_itself(pair):
    buffer, tree = pair
    process = subprocess.Popen(
        [sys.executable, '-c', WAITS, str(tree.domain_id), '3'],
        stdout=subprocess.PIPE, text=True)
    lines = [process.stdout.readline() for _ in range(4)]
    assert lines == ['asks\n'] * 4
    buffer.insert('map', 'odom', 3 * MS, TURNED)
    assert process.stdout.read() == 'answered 1\n' * 4
    assert process.wait() == 0


class SharedWaitsMachine(WaitsMachine):
    """Who waits in another process sleeps until the thread of the waits has seen the state."""

    def make(self):
        self.exits = ExitStack()
        self.buffer = SharingBuffer(CACHE_TIME)
        domain_id, _ = self.exits.enter_context(shared(self.buffer))
        self.asked = self.exits.enter_context(SharedTree(domain_id=domain_id))

    def teardown(self):
        for sleeper in getattr(self, 'sleepers', ()):
            sleeper.inquiry.end()
        if hasattr(self, 'exits'):
            self.exits.close()

    @invariant()
    def who_sleeps_has_reason_to(self):
        if not hasattr(self, 'sleepers'):
            return
        until(self.all_have_reason_to)

    def all_have_reason_to(self):
        """Return whether that is so; a sleeper that is being woken is in no queue."""
        self.sleepers = [sleeper for sleeper in self.sleepers if not sleeper.finished]
        return (all(sleeper.sleeps and sleeper.should_sleep() for sleeper in self.sleepers)
                and len(self.asked.waiting) == len(self.sleepers))


TestNobodySleepsWithoutReason = SharedWaitsMachine.TestCase
TestNobodySleepsWithoutReason.settings = examples(10, stateful_step_count=40)
