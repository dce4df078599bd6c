# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A buffer server is killed and replaced: waiting clients use the new one."""

import signal
import subprocess
import sys

import pytest
from ros_helpers import at, lasting, PATIENCE, PATIENCE_S, transform, until
from tf_tree_py import Buffer
from tf_tree_py.ros.remote.buffer_client import BufferClient
from tf_tree_py.ros.remote.buffer_server import BufferServer
from tf_tree_py.ros.remote.goal_state import State, WANTED

ACTION = 'tf2_buffer_server'
# A wait of this length is renewed every minute; only the new server can end it.
LONG_S = 1000


@pytest.fixture
def client(node):
    with BufferClient(node, ACTION, check_frequency=20.0) as client:
        yield client
    assert not client.action_client.goals_in(*State)


@pytest.fixture
def start_server():
    """Return a function that starts a server without data, in another process."""
    processes = []

    def start():
        processes.append(subprocess.Popen([sys.executable, '-m', 'tf_tree_py.nodes.buffer_server'],
                                          stdin=subprocess.DEVNULL))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.wait()


@pytest.fixture
def old_server(client, start_server):
    """Return such a server, when it is available."""
    process = start_server()
    assert client.wait_for_server(PATIENCE)
    return process


@pytest.fixture
def respawn(make_node, spin):
    """Return a function that starts a server with a new buffer in this process."""
    servers = []

    def respawn():
        buffer, node = Buffer(), make_node(f'serving{len(servers)}')
        servers.append(BufferServer(buffer, node, ACTION))
        spin(node)
        return buffer

    yield respawn
    for server in servers:
        server.close()


def long_wait(client):
    return client.wait_for_transform_async('map', 'base', at(1.0), lasting(LONG_S))


def kill(process):
    """End a server as a crash does: DDS still lists it for many seconds."""
    process.send_signal(signal.SIGKILL)
    process.wait()


def fill(buffer):
    for seconds in (0.5, 2.0):
        buffer.set_transform(transform('map', 'base', seconds, x=seconds), 'me')


def test_wait_that_was_accepted_goes_to_the_new_server(client, old_server, respawn):
    calls = [long_wait(client) for _ in range(20)]
    until(lambda: all(call.accepted for call in calls))
    kill(old_server)
    buffer = respawn()
    # They also wait at the new server, until it has the result.
    until(lambda: len(buffer.waiting) == len(calls))
    fill(buffer)
    until(lambda: all(call.done() for call in calls))
    assert {call.result().transform.translation.x for call in calls} == {1.0}


def test_wait_that_the_dead_server_never_accepted_goes_to_the_new_one(
        client, old_server, respawn):
    first = long_wait(client)
    until(lambda: first.accepted)
    kill(old_server)
    assert client.action_client.server_is_ready()
    # More than the maximum number of pending requests at a server.
    calls = [first, *(long_wait(client) for _ in range(20))]
    fill(respawn())
    until(lambda: all(call.done() for call in calls))
    assert {call.result().transform.translation.x for call in calls} == {1.0}


def test_waits_that_were_cancelled_at_the_dead_server_are_in_nobodys_way(
        client, old_server, respawn):
    first = long_wait(client)
    until(lambda: first.accepted)
    kill(old_server)
    # The maximum number of goals that may await acceptance.
    for call in [long_wait(client) for _ in range(8)]:
        until(lambda call=call: call.sent)
        call.cancel()
    fill(respawn())
    until(first.done)
    assert first.result().transform.translation.x == 1.0
    last = long_wait(client)
    until(last.done)


def test_blocking_lookup_gets_the_answer_of_the_new_server(client, old_server, respawn, pool):
    asked = pool.submit(client.lookup_transform, 'map', 'base', at(1.0), PATIENCE)
    until(lambda: any(call.accepted for call in client.action_client.goals_in(*WANTED)))
    kill(old_server)
    fill(respawn())
    assert asked.result(PATIENCE_S).transform.translation.x == 1.0


def test_wait_outlives_server_after_server(client, old_server, start_server, respawn):
    call = long_wait(client)
    until(lambda: call.accepted)
    for _ in range(2):
        kill(old_server)
        asked_before = call.goal_id
        old_server = start_server()
        until(lambda before=asked_before: call.accepted and call.goal_id != before)
    kill(old_server)
    fill(respawn())
    until(call.done)
    assert call.result().transform.translation.x == 1.0


def test_goals_leave_nothing_behind_at_a_server_that_lives_on(client, respawn):
    first = respawn()
    assert client.wait_for_server(PATIENCE)
    calls = [long_wait(client) for _ in range(5)]
    until(lambda: len(first.waiting) == len(calls))
    asked_before = [call.goal_id for call in calls]
    second = respawn()
    until(lambda: all(call.accepted and call.goal_id != before
                      for call, before in zip(calls, asked_before, strict=True)))
    # It drops the earlier goals after at most a minute, the length of a part of a wait.
    until(lambda: len(first.waiting) == len(calls), 2 * PATIENCE_S)
    for call in calls:
        call.cancel()
    until(lambda: len(first.waiting) == len(second.waiting) == 0, 2 * PATIENCE_S)


def test_cancelled_wait_is_cancelled_at_the_new_server(client, old_server, respawn):
    call = long_wait(client)
    until(lambda: call.accepted)
    kill(old_server)
    buffer = respawn()
    until(lambda: len(buffer.waiting) == 1)
    call.cancel()
    until(lambda: len(buffer.waiting) == 0)
