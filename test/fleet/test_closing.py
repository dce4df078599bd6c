# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Closing never waits for a router that hangs.

Here ``close`` waits for the connection for a moment only, and Zenoh's attempts to connect last
longer than any test, so what is still open after ``close`` was not waited for.
"""

from contextlib import suppress
import select
import socket
import subprocess
import sys
import threading

from conditions import until
from fleet_helpers import (
    connections_to,
    message,
    place,
    port_of,
    Router,
    session_at,
    x_of,
)
from programs import completed, PATIENCE_S
import pytest
from tf_tree_py.core import Sample
from tf_tree_py.fleet import (
    close_session,
    configuration,
    connection,
    FleetListener,
    listener as listening,
    open_session,
    robot_publisher,
    RobotPublisher,
    session as sessions,
)
from tf_tree_py.fleet.connection import Uplink
from tf_tree_py.fleet.session import CLOSE_S, end_soon
import zenoh

LARGE = [Sample('map', f'frame{number}', 1, place(1)) for number in range(25)]

AT_EXIT = """
import atexit, sys
from tf_tree_py.fleet import configuration, open_session, RobotPublisher
session = open_session(configuration(sys.argv[1]))
robot = RobotPublisher(session, 'robot7')
atexit.register(lambda: (robot.close(), print('closed', flush=True)))
"""
# Its attempt to connect lasts longer than the test waits for it.
ENDS_MEANWHILE = f"""
import sys, threading
from tf_tree_py.fleet import connection, FleetListener
connection.ATTEMPT_S = {4 * PATIENCE_S}
listener = FleetListener(sys.argv[1])
sys.stdin.readline()
listener.close()
print('still open:', any(thread.name == 'fleet' for thread in threading.enumerate()))
"""

SENDS_UNTIL_THE_END = """
import sys, threading
from tf_tree_py.fleet import configuration, open_session, RobotPublisher
session = open_session(configuration(sys.argv[1]))
robot, sends = RobotPublisher(session, 'robot7'), threading.Event()
def send():
    while True:
        robot.send(b'')
        sends.set()
threading.Thread(target=send, daemon=True).start()
sends.wait()
"""
# Its thread is in a call until a line arrives. The end waits longer than the test waits for it.
IS_IN_A_CALL = f"""
import atexit, os, threading
from tf_tree_py.fleet import session as ending
ending.END_S = {4 * PATIENCE_S}
begun = threading.Event()
def call():
    with ending.zenoh_call():
        begun.set()
        os.read(0, 1)
        print('returned', flush=True)
threading.Thread(target=call, daemon=True).start()
begun.wait()
"""
ENDS_IN_A_CALL = f"{IS_IN_A_CALL}\natexit.register(print, 'ends', flush=True)"
FORKS_IN_A_CALL = f"""{IS_IN_A_CALL}
child = os.fork()
if child:
    os.waitpid(child, 0)
    print('the child has ended', flush=True)
"""

# What is registered first runs last.
BEGINS_A_CALL_TOO_LATE = """
import atexit, threading
late = threading.Event()
def call():
    late.wait()
    with ending.zenoh_call():
        print('called', flush=True)
thread = threading.Thread(target=call, daemon=True)
atexit.register(lambda: (late.set(), thread.join(), print('ended', flush=True)))
from tf_tree_py.fleet import session as ending
ending.END_S = 0.1
thread.start()
"""


@pytest.fixture(autouse=True)
def limits(monkeypatch):
    for module in (connection, listening, sessions):
        monkeypatch.setattr(module, 'CLOSE_S', 0.1)
    for module in (connection, sessions):
        monkeypatch.setattr(module, 'ATTEMPT_S', 30.0)


@pytest.fixture
def router():
    router = Router()
    yield router
    router.kill()


def uplink_at(endpoint):
    return Uplink(endpoint, 'robot7', history=5_000)


def still_open(name):
    return any(thread.name == name for thread in threading.enumerate())


ENDS = pytest.mark.parametrize(('begin', 'thread'), [
    (FleetListener, 'fleet'), (uplink_at, 'uplink')], ids=['listener', 'uplink'])


def test_two_seconds_are_enough():
    assert CLOSE_S < 2.0


@ENDS
def test_closing_while_the_first_connection_hangs(router, begin, thread):
    router.hang()
    end = begin(router.endpoint)
    until(lambda: connections_to(router.endpoint))
    end.close()
    assert still_open(thread)
    router.kill()
    router.start()
    until(lambda: not still_open(thread))


def until_connected(end):
    until(lambda: end._link._session)


@ENDS
def test_closing_while_the_router_hangs_on_its_return(router, begin, thread):
    end = begin(router.endpoint)
    until(lambda: connections_to(router.endpoint))
    until_connected(end)
    router.kill()
    # Like a router that hangs before it can accept the connection.
    with socket.create_server(('127.0.0.1', port_of(router.endpoint))):
        until(lambda: connections_to(router.endpoint))
        end.close()
        assert still_open(thread)
    router.start()
    until(lambda: not still_open(thread))


@ENDS
def test_closing_while_the_router_is_away_or_hangs(router, begin, thread):
    for stop in (router.hang, router.kill):
        end = begin(router.endpoint)
        until_connected(end)
        stop()
        end.close()
        router.kill()
        until(lambda: not still_open(thread))
        router.start()


@pytest.fixture
def filling(router):
    """Return a listener that gets what a robot has stored, from a router that has hung since."""
    robot, listener = uplink_at(router.endpoint), FleetListener(router.endpoint)
    until(lambda: listener.robots())
    robot.send(LARGE)
    x_of(listener.buffer, 'map', 'robot7/frame0')
    router.kill()
    until(lambda: not listener.connected)
    for _ in range(5_000):
        robot.send(LARGE)
    router.start()
    until(lambda: listener.robots()[0].recovered)
    router.hang()
    return robot, listener


def test_closing_while_a_gap_is_being_filled(router, filling):
    robot, listener = filling
    listener.close()
    before = listener.robots()[0].transforms
    robot.close()
    router.kill()
    until(lambda: not still_open('fleet') and not still_open('uplink'))
    assert listener.robots()[0].transforms == before, 'nothing arrives any more'
    router.start()


@pytest.mark.parametrize('what', ['publisher', 'session'])
def test_closing_while_another_thread_waits_for_a_router_that_hangs(router, what):
    """It raises no error, neither here nor there; for how long it waits is tested below."""
    sent, ended = [], threading.Event()

    def send_much(robot):
        with suppress(zenoh.ZError):  # it was closed in the meantime
            while not ended.is_set():
                robot.send_static(bytes(100_000))
                sent.append(None)

    with FleetListener(router.endpoint) as listener:
        session = open_session(configuration(router.endpoint))
        robot = RobotPublisher(session, 'robot7')
        until(lambda: listener.robots())
        router.hang()
        sending = threading.Thread(target=send_much, args=(robot,))
        sending.start()
        until(lambda: sent)
        robot.close() if what == 'publisher' else close_session(session)
        ended.set()
        router.kill()
        sending.join()
        until(lambda: not still_open('fleet end'))
        close_session(session)
    router.start()


def test_heartbeats_do_not_wait_for_a_router_that_hangs(router, monkeypatch):
    """Zenoh sends either those that wait and are not repeated, or those that are repeated."""
    monkeypatch.setattr(robot_publisher, 'HEARTBEAT_S', 0.05)
    with session_at(router.endpoint) as session, RobotPublisher(session, 'robot7') as robot:
        beats = session.declare_subscriber('robot7/tf/@adv/pub/**')
        robot.send(message(('map', 'base', 1)))
        for _ in range(3):
            until(beats.try_recv)


def test_work_that_hangs_is_waited_for_only_a_moment():
    held = threading.Event()
    end_soon(lambda: held.wait(PATIENCE_S))
    assert still_open('fleet end')
    held.set()
    until(lambda: not still_open('fleet end'))


def test_publisher_may_be_closed_when_the_interpreter_ends(router):
    """Python starts no more threads then."""
    ended = completed(sys.executable, '-c', AT_EXIT, router.endpoint)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, 'closed\n', '')


def test_program_ends_normally_while_the_rest_is_still_being_closed():
    with socket.create_server(('127.0.0.1', 0)) as hangs, subprocess.Popen(
            [sys.executable, '-c', ENDS_MEANWHILE, f'tcp/127.0.0.1:{hangs.getsockname()[1]}'],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True) as program:
        assert select.select([hangs], [], [], PATIENCE_S)[0], 'it connects'
        output, errors = program.communicate('close\n', timeout=PATIENCE_S)
    assert (program.returncode, output, errors) == (0, 'still open: True\n', '')


def test_program_ends_normally_while_a_thread_sends(router):
    """Zenoh aborts a process whose daemon threads are in its calls when Python ends."""
    ended = completed(sys.executable, '-c', SENDS_UNTIL_THE_END, router.endpoint)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, '', '')


@pytest.mark.parametrize(('program', 'before'), [
    (ENDS_IN_A_CALL, 'ends\n'), (FORKS_IN_A_CALL, 'the child has ended\n')],
    ids=['ends', 'forks'])
def test_end_of_a_program_waits_for_calls_in_its_own_threads(program, before):
    with subprocess.Popen([sys.executable, '-W', 'ignore', '-c', program], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as program:
        assert select.select([program.stdout], [], [], PATIENCE_S)[0]
        assert program.stdout.readline() == before
        output, errors = program.communicate('\n', timeout=PATIENCE_S)
    assert (program.returncode, output, errors) == (0, 'returned\n', '')


def test_no_thread_begins_a_call_after_that():
    ended = completed(sys.executable, '-c', BEGINS_A_CALL_TOO_LATE)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, 'ended\n', '')


def test_a_listener_that_its_own_callback_holds_up_is_closed_meanwhile(router):
    begun, held = threading.Event(), threading.Event()

    def on_robot(name, here):
        begun.set()
        held.wait(PATIENCE_S)

    listener = FleetListener(router.endpoint, on_robot=on_robot)
    with session_at(router.endpoint) as session, RobotPublisher(session, 'robot7') as robot:
        robot.send(message(('map', 'base', 1)))
        x_of(listener.buffer, 'map', 'robot7/base')
        assert begun.wait(PATIENCE_S)
        listener.close()
        assert still_open('fleet')
        robot.send(message(('map', 'other', 1)))
        held.set()
        until(lambda: not still_open('fleet'))
    assert 'robot7/other' not in listener.buffer.frames()
