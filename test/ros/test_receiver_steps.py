# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a receiver's thread calls, without any message: work, checks, and what comes at its end."""

import threading
import weakref

import pytest
from ros_helpers import PATIENCE_S, until
from std_msgs.msg import String
from tf_tree_py.ros.threads.internal_node import is_alive
from tf_tree_py.ros.threads.receiver import Receiver
from tf_tree_py.ros.threads.responses import Responses

pytestmark = pytest.mark.usefixtures('use_wait_set')


@pytest.fixture
def receive(make_node):
    """Make receivers of nodes with one subscription, and close them."""
    receivers = []

    def begin(on_end=int, **options):
        node = make_node('home')
        node.create_subscription(String, 'topic', lambda _: None, 10, raw=True)
        receivers.append(Receiver(node, on_end, **options))
        begin.node = weakref.ref(node)
        return receivers[-1]

    yield begin
    for receiver in receivers:
        receiver.close()


def test_thread_is_named_after_its_node_and_ends_with_it(receive, context):
    ended = []
    receiver = receive(lambda: ended.append(threading.current_thread()))
    assert receiver.context is context
    assert receiver.thread.name == 'home receiver'
    assert receiver.thread.daemon
    assert is_alive(receive.node)
    for _ in range(2):
        receiver.close()
        assert not receiver.thread.is_alive()
        assert not is_alive(receive.node)
    assert ended == [receiver.thread]


def test_work_goes_on_as_long_as_some_is_left(receive, log):
    done, enough = [], threading.Event()

    def work():
        done.append(threading.current_thread())
        if len(done) == 3:
            raise SystemExit('in the middle')
        if len(done) >= 6:
            enough.set()
        return len(done) < 6

    receiver = receive(work=work)
    assert enough.wait(PATIENCE_S)
    assert len(done) == 6
    receiver.wake()
    until(lambda: len(done) == 7)
    assert {*done} == {receiver.thread}
    assert log().count('a callback failed:') == 1
    assert 'SystemExit: in the middle' in log()


def test_receiver_that_is_not_wanted_any_more_ends_when_it_is_woken(receive):
    wanted, ended = [True], threading.Event()
    receiver = receive(ended.set, is_wanted=lambda: wanted[0])
    receiver.wake()
    assert not ended.wait(0.02)
    wanted[0] = False
    receiver.wake()
    assert ended.wait(PATIENCE_S)
    receiver.thread.join(PATIENCE_S)
    assert not is_alive(receive.node)


def test_error_at_the_end_is_logged(receive, log):
    def fail():
        raise SystemExit('at the end')

    receiver = receive(fail)
    receiver.close()
    assert log().count('a callback failed:') == 1
    assert 'SystemExit: at the end' in log()


def test_error_of_the_log_does_not_end_the_thread(receive, log):
    """Counts are written about once a second."""
    called = threading.Event()

    def fail():
        called.set()
        raise ValueError('of a log')

    receiver = receive(write_counts=fail, work=lambda: not called.is_set())
    assert called.wait(PATIENCE_S)
    until(lambda: 'a log failed:' in log())
    assert receiver.thread.is_alive()


@pytest.mark.parametrize('use_wait_set', [True], indirect=True)
def test_who_catches_up_waits_for_the_next_reading_only(receive):
    """It ends a rest; nothing is left to wait for at the end, or in the thread itself."""
    def work():
        if threading.current_thread() in here:
            receiver.catch_up(10.0 * PATIENCE_S)
            inside.set()
        return False

    here, inside, rested = set(), threading.Event(), []
    receiver = receive(work=work, end_rest=lambda: rested.append('ended'))
    for count in range(1, 4):
        receiver.catch_up(PATIENCE_S * 10.0)
        assert len(rested) == count
    here.add(receiver.thread)
    receiver.wake()
    assert inside.wait(PATIENCE_S)
    assert len(rested) == 3
    receiver.close()
    receiver.catch_up(PATIENCE_S * 10.0)
    assert len(rested) == 3


@pytest.mark.parametrize('use_wait_set', [False], indirect=True)
def test_executor_has_nothing_to_catch_up_with(receive):
    rested = []
    receiver = receive(end_rest=lambda: rested.append('ended'))
    receiver.catch_up(PATIENCE_S * 10.0)
    receiver.wait_for_last_read(PATIENCE_S * 10.0)
    assert rested == []
    assert receiver.thread.is_alive()


# --- responses


@pytest.mark.parametrize('use_wait_set', [True], indirect=True)
def test_check_is_repeated_as_long_as_it_asks_for_it(make_node, log):
    checked, enough = [], threading.Event()

    def check():
        checked.append(threading.current_thread())
        if len(checked) == 2:
            raise SystemExit('in a check')
        if len(checked) == 5:
            enough.set()
        return len(checked) < 5

    responses = Responses(make_node('home'), int, check, 0.002)
    try:
        assert not enough.wait(0.02)
        assert checked == [], 'it was not woken'
        responses.wake()
        assert enough.wait(PATIENCE_S)
        assert {*checked} == {responses.thread}
        assert log().count('a check failed:') == 1
        responses.thread.join(0.02)
        assert len(checked) == 5
        responses.wake()
        until(lambda: len(checked) == 6)
    finally:
        responses.close()
    assert not responses.thread.is_alive()
