# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import queue
import threading
import time

from hypothesis import strategies as st
from hypothesis.stateful import invariant, rule, RuleBasedStateMachine
from memory import bytes_of
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import (
    ConnectivityException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LATEST,
    LookupException,
    PastExtrapolationException,
    Pose,
    Sample,
    TransformException,
)
from tf_tree_py.core.buffer import waiting
from tf_tree_py.core.buffer.waiting import Inquiry, Waiting
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.errors import ANY_STRUCTURE
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.tree.tree import Tree

SECOND = 1_000_000_000
LONG_S = 15.0  # only a broken wait lasts this long


# --- the lists alone


class Blocked(Inquiry):
    """An inquiry whose query fails; ``blockers`` are what would change that."""

    def __init__(self, waiting, woken):
        super().__init__(waiting, self._fail, lambda: woken.append(self))

    def _fail(self):
        raise TransformException(blocked_on=self.blockers)


class QueuesMachine(RuleBasedStateMachine):
    """The sorted queues compared with a dict of inquiries, each blocked by several events."""

    def __init__(self):
        super().__init__()
        self.waiting, self.woken = Waiting(threading.RLock()), []
        self.everybody = [Blocked(self.waiting, self.woken) for _ in range(8)]
        self.model = {}

    children = st.sampled_from(['a', 'b', None])
    numbers = st.integers(0, 7)

    @rule(number=numbers, blockers=st.lists(
        st.tuples(children, st.integers(0, 9)), min_size=1, max_size=4))
    def enter(self, number, blockers):
        self.everybody[number].blockers = blockers
        assert self.everybody[number].ask() is None
        self.model[number] = set(blockers)

    @rule(number=numbers)
    def leave(self, number):
        self.everybody[number].end()
        assert not self.everybody[number].places
        self.everybody[number] = Blocked(self.waiting, self.woken)
        self.model.pop(number, None)

    @rule(child=st.sampled_from('abc'), latest=st.integers(-1, 10))
    def reach(self, child, latest):
        ready = {number for number, blockers in self.model.items()
                 if any(edge == child and stamp <= latest for edge, stamp in blockers)}
        tree = Tree(SECOND, 9, 9)
        tree.insert('map', child, latest, Pose(), '', False)
        self.waiting.change(tree, lambda: [child], lambda: None)
        self.are_woken(ready)

    @rule()
    def ask_again(self):
        self.waiting.ask_again()
        self.are_woken(set(self.model))

    def are_woken(self, expected):
        numbers = [self.everybody.index(inquiry) for inquiry in self.woken]
        assert sorted(numbers) == sorted(expected)
        self.woken.clear()
        for number in expected:
            assert not self.everybody[number].places
            del self.model[number]

    @invariant()
    def everybody_stands_where_the_model_says(self):
        assert len(self.waiting) == len(self.model)
        assert self.waiting.sleep_until_somebody(0.0) == bool(self.model)
        for number, inquiry in enumerate(self.everybody):
            assert set(inquiry.places) == self.model.get(number, set())


TestQueuesAreInOrder = QueuesMachine.TestCase


def test_queue_in_which_nobody_stands_any_more_takes_no_memory():
    waiting = Waiting(threading.RLock())
    for number in range(1000):
        inquiry = Blocked(waiting, [])
        inquiry.blockers = [(f'frame{number}', 1)]
        inquiry.ask()
        inquiry.end()
    assert bytes_of(waiting) < 20_000


# --- waiting on a buffer


class WatchedDeadline:
    """A distant deadline that reports when its thread goes to sleep."""

    def __init__(self):
        self.sleeping = queue.Queue()
        self.was_set_before = self.has_passed = False

    def wait(self, event):
        # In these tests, nothing arrives before the thread sleeps.
        self.was_set_before |= event.is_set()
        self.sleeping.put(True)
        self.has_passed = not event.wait(LONG_S)
        return not self.has_passed

    def elapsed_s(self):
        return 0.0


class ExpiredDeadline:
    """A deadline that has passed, after 1.5 s."""

    def wait(self, event):
        return False

    def elapsed_s(self):
        return 1.5


class Asker:
    """A thread that waits for a lookup; ``result`` is its pose or error."""

    def __init__(self, buffer, target, source, stamp):
        self.buffer = buffer
        self.arguments = target, source, stamp
        self.tries = 0
        self.deadline = WatchedDeadline()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self):
        try:
            self.result = self.buffer.wait_for(self._ask, self.deadline)
        except TransformException as error:
            self.result = error

    def _ask(self):
        self.tries += 1
        return self.buffer.lookup(*self.arguments)

    def sleeps(self):
        """Return when the thread sleeps, again if it was woken."""
        self.deadline.sleeping.get(timeout=LONG_S)
        return self

    def joined(self):
        self.thread.join(2 * LONG_S)
        assert not self.thread.is_alive()
        assert not self.deadline.has_passed, 'nobody woke it'
        assert not self.deadline.was_set_before, 'woken without a reason'
        return self.result


@pytest.fixture
def buffer():
    """Return a buffer with one edge at 10 s; at the end, no thread may still wait in it."""
    buffer = BufferCore(10 * SECOND)
    buffer.insert('map', 'base', 10 * SECOND, Pose(1.0))
    yield buffer
    assert len(buffer.waiting) == 0


def test_what_is_there_is_not_waited_for(buffer):
    asker = Asker(buffer, 'map', 'base', 10 * SECOND)
    assert asker.joined() == Pose(1.0)
    assert asker.deadline.sleeping.empty()


ARRIVAL = Sample('map', 'base', 11 * SECOND, Pose(2.0))


@pytest.mark.parametrize('insert', [
    lambda buffer: buffer.insert(*ARRIVAL),
    lambda buffer: buffer.insert('/map', '/base', *ARRIVAL[2:]),
    lambda buffer: buffer.insert_many([ARRIVAL]),
    lambda buffer: buffer.insert_many(sample for sample in [ARRIVAL]),
    lambda buffer: buffer.insert_batch(
        Batch((('map', 'base'),), [11 * SECOND], [pack_pose(*Pose(2.0))])),
], ids=['insert', 'with slashes', 'list', 'generator', 'batch'])
def test_lookup_wakes_when_its_stamp_arrives(buffer, insert):
    asker = Asker(buffer, 'map', 'base', 11 * SECOND).sleeps()
    assert not insert(buffer)
    assert asker.joined() == Pose(2.0)
    assert asker.tries == 2


def test_lookup_between_two_samples_wakes_with_the_second(buffer):
    asker = Asker(buffer, 'map', 'base', 11 * SECOND).sleeps()
    buffer.insert('map', 'base', 12 * SECOND, Pose(3.0))
    assert asker.joined() == Pose(2.0)


def test_latest_waits_for_the_slowest_edge_to_catch_up(buffer):
    """The newest common time is before the other edge began; only the slow edge can fix that."""
    buffer.insert('base', 'arm', 30 * SECOND, Pose(0.5))
    asker = Asker(buffer, 'map', 'arm', LATEST).sleeps()
    buffer.insert('map', 'base', 30 * SECOND, Pose(2.0))
    assert asker.joined() == Pose(2.5)


def test_query_is_tried_once_more_when_time_is_up(buffer):
    not_yet = FutureExtrapolationException('not yet', blocked_on=(('base', LATEST),))
    answers = iter([not_yet, 'now'])

    def query():
        answer = next(answers)
        if isinstance(answer, TransformException):
            raise answer
        return answer

    assert buffer.wait_for(query, ExpiredDeadline()) == 'now'


def test_only_those_whose_stamp_was_reached_are_woken(buffer):
    buffer.insert('map', 'other', SECOND, Pose())
    askers = [Asker(buffer, 'map', 'base', stamp * SECOND).sleeps() for stamp in (14, 12, 13, 11)]
    assert len(buffer.waiting) == 4
    # Another edge wakes no thread.
    buffer.insert('map', 'other', 99 * SECOND, Pose())
    assert len(buffer.waiting) == 4
    buffer.insert('map', 'base', 12 * SECOND, Pose(3.0))
    assert len(buffer.waiting) == 2
    assert [askers[i].joined() for i in (1, 3)] == [Pose(3.0), Pose(2.0)]
    buffer.insert('map', 'base', 20 * SECOND, Pose(3.0))
    assert [askers[i].joined() for i in (0, 2)] == [Pose(3.0)] * 2
    assert [asker.tries for asker in askers] == [2] * 4


def test_sample_after_a_change_of_parent_wakes_only_its_waiters(buffer):
    buffer.insert('map', 'box', 10 * SECOND, Pose(1.0))
    buffer.insert('base', 'box', 11 * SECOND, Pose(1.0))
    asker = Asker(buffer, 'map', 'base', 11 * SECOND).sleeps()
    buffer.insert('base', 'box', 12 * SECOND, Pose(1.0))
    assert len(buffer.waiting) == 1
    # Another change of its parent wakes all.
    buffer.insert('map', 'box', 13 * SECOND, Pose(1.0))
    asker.sleeps()
    buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
    assert asker.joined() == Pose(2.0)
    assert asker.tries == 3


def test_late_sample_wakes_who_waits_for_an_older_stamp(buffer):
    asker = Asker(buffer, 'map', 'base', 9 * SECOND).sleeps()
    buffer.insert('map', 'base', 8 * SECOND, Pose(3.0))
    assert asker.joined() == Pose(2.0)


def test_late_sample_before_the_epoch_wakes_too():
    buffer = BufferCore(100)
    buffer.insert('map', 'base', -10, Pose(1.0))
    asker = Asker(buffer, 'map', 'base', -20).sleeps()
    buffer.insert('map', 'base', -30, Pose(3.0))
    assert asker.joined() == Pose(2.0)


@pytest.mark.parametrize('static', [True, False])
def test_unknown_frame_wakes_when_it_is_published(buffer, static):
    asker = Asker(buffer, 'map', 'camera', LATEST).sleeps()
    buffer.insert('base', 'camera', 10 * SECOND, Pose(1.0), static=static)
    assert asker.joined() == Pose(2.0)


def test_two_trees_wake_when_they_are_joined(buffer):
    buffer.insert('island', 'tree', 0, Pose(1.0), static=True)
    asker = Asker(buffer, 'base', 'tree', 10 * SECOND).sleeps()
    buffer.insert('base', 'island', 0, Pose(1.0), static=True)
    assert asker.joined() == Pose(2.0)


def test_lookup_that_needs_two_edges_wakes_for_each(buffer):
    buffer.insert('base', 'arm', 10 * SECOND, Pose(1.0))
    asker = Asker(buffer, 'map', 'arm', 11 * SECOND).sleeps()
    buffer.insert('map', 'base', 11 * SECOND, Pose(1.0))
    asker.sleeps()
    assert len(buffer.waiting) == 1
    buffer.insert('base', 'arm', 11 * SECOND, Pose(1.0))
    assert asker.joined() == Pose(2.0)


def test_cleared_edge_wakes_with_its_first_new_sample(buffer):
    buffer.clear()
    asker = Asker(buffer, 'map', 'base', 5 * SECOND).sleeps()
    buffer.insert('map', 'base', 4 * SECOND, Pose(1.0))
    asker.sleeps()
    buffer.insert('map', 'base', 6 * SECOND, Pose(3.0))
    assert asker.joined() == Pose(2.0)


def test_whole_message_wakes_after_its_last_transform(buffer):
    asker = Asker(buffer, 'map', 'lens', 11 * SECOND).sleeps()
    buffer.insert_many(
        Sample(parent, child, 11 * SECOND, Pose(1.0))
        for parent, child in (('base', 'camera'), ('camera', 'lens'), ('map', 'base')))
    assert asker.joined() == Pose(3.0)
    assert asker.tries == 2


def test_refused_sample_wakes_nobody(buffer):
    asker = Asker(buffer, 'map', 'base', 11 * SECOND).sleeps()
    assert buffer.insert('map', 'base', 11 * SECOND, Pose(float('nan')))
    assert buffer.insert('base', 'map', 11 * SECOND, Pose())
    assert len(buffer.waiting) == 1
    buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
    assert asker.joined() == Pose(2.0)
    assert asker.tries == 2


def test_many_wait_for_one_sample(buffer):
    askers = [Asker(buffer, 'map', 'base', 11 * SECOND) for _ in range(20)]
    for asker in askers:
        asker.sleeps()
    buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
    assert [asker.joined() for asker in askers] == [Pose(2.0)] * 20


# --- timeouts and failures


@pytest.mark.parametrize(('target', 'source', 'stamp', 'error'), [
    ('map', 'base', 11 * SECOND, FutureExtrapolationException),
    ('map', 'base', 9 * SECOND, PastExtrapolationException),
    ('map', 'nowhere', LATEST, LookupException),
    ('map', 'tree', LATEST, ConnectivityException),
])
def test_timeout_raises_the_querys_own_error_and_says_how_long_it_waited(
        buffer, target, source, stamp, error):
    buffer.insert('island', 'tree', 0, Pose(1.0), static=True)
    with pytest.raises(error, match=r'waited 1\.500 s for it') as raised:
        buffer.wait_for(lambda: buffer.lookup(target, source, stamp), ExpiredDeadline())
    assert raised.value.waited_s == 1.5
    assert (raised.value.target_frame, raised.value.source_frame) == (target, source)


def test_what_arrives_in_the_last_moment_is_still_found(buffer):
    deadline = ExpiredDeadline()

    def arrive(event):
        buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
        return False

    deadline.wait = arrive
    assert buffer.wait_for(
        lambda: buffer.lookup('map', 'base', 11 * SECOND), deadline) == Pose(2.0)


def test_error_without_a_wait_says_nothing_of_one(buffer):
    with pytest.raises(FutureExtrapolationException) as raised:
        buffer.lookup('map', 'base', 11 * SECOND)
    assert raised.value.waited_s is None
    assert 'waited' not in str(raised.value)


@pytest.mark.parametrize(('target', 'source', 'stamp', 'error'), [
    ('/map', 'base', LATEST, InvalidArgumentException),
    ('map', 'base', 1, PastExtrapolationException),
    ('map', 'base', 20 * SECOND - 1, PastExtrapolationException),
])
def test_what_can_never_succeed_fails_at_once(buffer, target, source, stamp, error):
    buffer.insert('map', 'base', 30 * SECOND, Pose(1.0))
    buffer.insert('map', 'base', 30 * SECOND, Pose(1.0))
    asker = Asker(buffer, target, source, stamp)
    assert isinstance(asker.joined(), error)
    assert asker.tries == 1
    assert asker.deadline.sleeping.empty()
    assert asker.result.waited_s is None


def test_wait_ends_when_the_window_moves_past_its_stamp(buffer):
    asker = Asker(buffer, 'map', 'base', 9 * SECOND).sleeps()
    buffer.insert('map', 'base', 40 * SECOND, Pose(1.0))
    error = asker.joined()
    assert isinstance(error, PastExtrapolationException)
    assert error.blocked_on is None
    assert error.waited_s == 0.0


def test_lookup_within_waits_by_the_wall(buffer):
    begin = time.monotonic()
    with pytest.raises(FutureExtrapolationException, match=r'waited \d'):
        buffer.lookup_within(0.03, 'map', 'base', 11 * SECOND)
    assert time.monotonic() - begin >= 0.03
    timer = threading.Timer(0.01, buffer.insert, ('map', 'base', 11 * SECOND, Pose(2.0)))
    timer.start()
    assert buffer.lookup_within(LONG_S, 'map', 'base', 11 * SECOND) == Pose(2.0)
    timer.join()


def test_failed_waiters_get_the_reason_each_for_itself(buffer):
    askers = [Asker(buffer, 'map', 'base', stamp * SECOND).sleeps() for stamp in (11, 12)]
    askers.append(Asker(buffer, 'map', 'nowhere', LATEST).sleeps())
    reason = TransformException('the clock jumped back')
    buffer.waiting.fail(reason)
    errors = [asker.joined() for asker in askers]
    for error in errors:
        assert type(error) is TransformException
        assert 'the clock jumped back (waited' in str(error)
    # A single exception raised in three threads would mix up their tracebacks.
    assert len({id(error) for error in (*errors, reason)}) == 4


def test_failure_reaches_who_is_just_being_woken(buffer, monkeypatch):
    """For example if the clock jumps back between the arrival of a transform and its effect."""
    wake_all = waiting.wake_all

    def wake_later(waiters):
        monkeypatch.undo()
        buffer.waiting.fail(TransformException('the clock jumped back'))
        wake_all(waiters)

    asker = Asker(buffer, 'map', 'base', 11 * SECOND).sleeps()
    monkeypatch.setattr(waiting, 'wake_all', wake_later)
    buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
    assert 'the clock jumped back (waited' in str(asker.joined())


def test_those_who_come_after_a_failure_wait_again(buffer):
    buffer.waiting.fail(TransformException('nobody is there'))
    asker = Asker(buffer, 'map', 'base', 11 * SECOND).sleeps()
    buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
    assert asker.joined() == Pose(2.0)


def test_error_of_another_kind_leaves_nobody_behind(buffer):
    def broken():
        raise ZeroDivisionError('a bug in the query')

    with pytest.raises(ZeroDivisionError, match='a bug'):
        buffer.wait_for(broken, WatchedDeadline())


def test_interrupted_wait_leaves_nobody_behind(buffer):
    deadline = WatchedDeadline()

    def interrupt(event):
        assert len(buffer.waiting) == 1
        raise KeyboardInterrupt

    deadline.wait = interrupt
    with pytest.raises(KeyboardInterrupt):
        buffer.wait_for(lambda: buffer.lookup('map', 'base', 11 * SECOND), deadline)


def test_wake_is_called_without_the_lock(buffer):
    """A wake-up function that itself looks up in another thread gets a result."""
    answers = queue.Queue()

    def wake():
        thread = threading.Thread(
            target=lambda: answers.put(buffer.lookup('map', 'base', 10 * SECOND)), daemon=True)
        thread.start()
        thread.join(LONG_S)

    Inquiry(buffer.waiting, lambda: buffer.lookup('map', 'base', 11 * SECOND), wake).ask()
    buffer.insert('map', 'base', 11 * SECOND, Pose(2.0))
    assert answers.get_nowait() == Pose(1.0)


class InterruptedLock:
    """A lock, at whose next release Ctrl-C is pressed."""

    def __init__(self):
        self._lock, self.presses = threading.RLock(), 1

    def __enter__(self):
        self._lock.acquire()

    def __exit__(self, *_):
        self._lock.release()
        if self.presses:
            self.presses -= 1
            raise KeyboardInterrupt


def test_ctrl_c_just_after_a_wait_has_begun_ends_it():
    def fail():
        raise LookupException('no such frame', blocked_on=ANY_STRUCTURE)

    waiters = Waiting(InterruptedLock())
    with pytest.raises(KeyboardInterrupt):
        waiters.wait_for(fail, lambda _: waiting.WallDeadline(LONG_S))
    assert len(waiters) == 0


def test_structure_blocks_under_a_name_of_its_own():
    assert ANY_STRUCTURE == ((None, LATEST),)
    with pytest.raises(LookupException) as raised:
        BufferCore().lookup('a', 'b')
    assert raised.value.blocked_on == ANY_STRUCTURE
