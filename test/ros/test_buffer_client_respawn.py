# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A buffer server is killed and replaced: waiting clients use the new one."""

from contextlib import ExitStack

from programs import executable, Program
import pytest
from ros_helpers import at, lasting, move, PATIENCE, PATIENCE_S, result_of, until
from tf_tree_py import Buffer
from tf_tree_py.ros.remote.buffer_client import BufferClient
from tf_tree_py.ros.remote.buffer_server import BufferServer
from tf_tree_py.ros.remote.lookup_goal import State, WANTED

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
    with ExitStack() as programs:
        def start():
            program = Program(*executable('buffer_server'))
            programs.callback(program.kill)
            return program

        yield start


@pytest.fixture
def respawn(make_node, spin):
    """Return a function that starts a server with a new buffer in this process."""
    with ExitStack() as servers:
        def respawn():
            buffer, node = Buffer(), make_node('serving')
            servers.enter_context(BufferServer(buffer, node, ACTION))
            spin(node)
            return buffer

        yield respawn


def long_wait(client):
    return client.wait_for_transform_async('map', 'base', at(1.0), lasting(LONG_S))


def until_accepted(client, count):
    until(lambda: sum(call.accepted for call in client.action_client.goals_in(*WANTED)) == count)


def test_waits_outlive_server_after_server(client, start_server, respawn, pool):
    server = start_server()
    assert client.wait_for_server(PATIENCE)
    calls = [long_wait(client) for _ in range(20)]
    blocking = pool.submit(client.lookup_transform, 'map', 'base', at(1.0), lasting(LONG_S))
    until_accepted(client, 21)
    # As in a crash: DDS still lists it for many seconds.
    server.kill()
    assert client.action_client.server_is_ready()
    # More than the maximum number of pending requests at a server.
    calls += [long_wait(client) for _ in range(20)]
    asked_before = [call.goal_id for call in calls]
    server = start_server()
    until(lambda: all(call.goal_id != before
                      for call, before in zip(calls, asked_before, strict=True)))
    until_accepted(client, 41)
    server.kill()
    # The maximum number of goals that may await acceptance: cancelled, they are in nobody's way.
    for call in [long_wait(client) for _ in range(8)]:
        until(lambda call=call: call.sent)
        call.cancel()
    other = client.wait_for_transform_async('map', 'lamp', at(1.0), lasting(LONG_S))
    buffer = respawn()
    # All wait at the new server, until it has the result.
    until(lambda: len(buffer.waiting) >= 42)
    for seconds in (0.5, 2.0):
        move(buffer, seconds)
    assert {result_of(call).transform.translation.x for call in [*calls, blocking]} == {1.0}
    until(lambda: len(buffer.waiting) == 1)
    # Nothing is left behind at this server when another joins it.
    asked_before = other.goal_id
    second = respawn()
    until(lambda: other.accepted and other.goal_id != asked_before)
    # It drops the earlier goal after at most a minute, the length of a part of a wait.
    until(lambda: len(buffer.waiting) == 1, 2 * PATIENCE_S)
    other.cancel()
    until(lambda: len(buffer.waiting) == len(second.waiting) == 0, 2 * PATIENCE_S)
