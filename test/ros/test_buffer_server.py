# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buffer server, called by rclpy's own action client like tf2's clients."""

import re
import threading

from action_clients import close_race
from action_msgs.msg import GoalStatus
import pytest
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from ros_helpers import (
    at,
    lasting,
    move,
    PATIENCE_S,
    SIM_TIME,
    transform,
    until,
    until_waiting,
)
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error
from tf_tree_py import TransformException
from tf_tree_py.ros.remote.buffer_server import BufferServer

SUCCEEDED, ABORTED, CANCELED = (
    GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_CANCELED)


def goal(source='base', seconds=1.5, timeout=0.0, target='map'):
    return LookupTransform.Goal(
        target_frame=target, source_frame=source, source_time=at(seconds).to_msg(),
        timeout=lasting(timeout).to_msg())


class Asker:
    """rclpy's client, with the results of its goals."""

    def __init__(self, node):
        self.node = node
        self.client = close_race(ActionClient(node, LookupTransform, 'tf2_buffer_server'))

    def until_served(self):
        until(self.client.server_is_ready)

    def send(self, wanted):
        """Return the handle of an accepted goal, and the future of its result."""
        handle = settled(self.client.send_goal_async(wanted))
        assert handle.accepted
        return handle, handle.get_result_async()

    def ask(self, wanted):
        """Return the status and the result."""
        response = settled(self.send(wanted)[1])
        return response.status, response.result


def settled(future):
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    assert done.wait(PATIENCE_S)
    return future.result()


@pytest.fixture(params=[SingleThreadedExecutor, MultiThreadedExecutor])
def kind(request):
    return request.param


@pytest.fixture
def serve(make_node, spin):
    """Serve buffers until the end of the test."""
    servers = []

    def begin(buffer, kind=SingleThreadedExecutor, **options):
        node = make_node('serving', **options)
        servers.append(BufferServer(buffer, node))
        spin(node, kind=kind)
        return servers[-1]

    yield begin
    for server in servers:
        server.close()


@pytest.fixture
def asker(make_node, spin):
    node = make_node('asking')
    asker = Asker(node)
    spin(node)
    return asker


@pytest.fixture
def server(buffer, serve, asker, kind):
    server = serve(buffer, kind)
    asker.until_served()
    return server


# --- results


@pytest.mark.usefixtures('server')
def test_what_is_there_is_answered_at_once(asker):
    status, result = asker.ask(goal())
    assert status == SUCCEEDED
    assert result.error == TF2Error()
    assert result.transform == transform('map', 'base', 1.5, x=1.5, w=1.0)


@pytest.mark.usefixtures('server')
def test_advanced_goal_goes_through_the_fixed_frame(asker):
    wanted = goal(seconds=2.0, target='base')
    wanted.advanced, wanted.fixed_frame, wanted.target_time = True, 'map', at(1.0).to_msg()
    status, result = asker.ask(wanted)
    assert status == SUCCEEDED
    assert result.transform.transform.translation.x == 1.0
    assert result.transform.header.stamp == at(1.0).to_msg()


@pytest.mark.usefixtures('server')
def test_goal_waits_for_what_arrives_later(asker, buffer):
    _, future = asker.send(goal(seconds=3.0, timeout=PATIENCE_S))
    until_waiting(buffer)
    assert not future.done()
    move(buffer, 4.0)
    response = settled(future)
    assert response.status == SUCCEEDED
    assert response.result.transform.transform.translation.x == 3.0


@pytest.mark.usefixtures('server')
def test_goals_are_answered_in_whatever_order_they_can_be(asker, buffer):
    futures = [asker.send(goal(seconds=seconds, timeout=PATIENCE_S))[1]
               for seconds in (5.0, 4.0, 3.0)]
    until_waiting(buffer, 3)
    for seconds, future in zip((3.0, 4.0, 5.0), reversed(futures), strict=True):
        move(buffer, seconds)
        assert settled(future).result.transform.transform.translation.x == seconds


@pytest.mark.usefixtures('server')
@pytest.mark.parametrize(('wanted', 'code', 'text'), [
    (goal('nowhere'), TF2Error.LOOKUP_ERROR, 'nowhere.*does not exist'),
    (goal('tree'), TF2Error.CONNECTIVITY_ERROR, 'not part of the same tree'),
    (goal(seconds=3.0), TF2Error.EXTRAPOLATION_ERROR, 'into the future'),
    (goal(seconds=0.5), TF2Error.EXTRAPOLATION_ERROR, 'into the past'),
    (goal(''), TF2Error.INVALID_ARGUMENT_ERROR, 'Invalid argument source_frame'),
])
def test_failure_without_a_timeout_is_an_answer_with_its_code(asker, buffer, wanted, code, text):
    """The goal succeeds with the error as its result, as with tf2's server."""
    buffer.set_transform(transform('island', 'tree', 1.5), 'me')
    status, result = asker.ask(wanted)
    assert status == SUCCEEDED
    assert result.error.error == code
    assert re.search(text, result.error.error_string)


@pytest.mark.usefixtures('server')
def test_timeout_is_told_as_one_with_the_reason(asker):
    status, result = asker.ask(goal(seconds=3.0, timeout=0.03))
    assert status == ABORTED
    assert result.error.error == TF2Error.TIMEOUT_ERROR
    told = re.search(r'future.*map -> base.*waited (\d+\.\d{3}) s', result.error.error_string)
    assert float(told[1]) >= 0.03


@pytest.mark.usefixtures('server')
@pytest.mark.parametrize(('wanted', 'code'), [
    (goal(seconds=1.0, timeout=3600.0), TF2Error.EXTRAPOLATION_ERROR),
    (goal('/base', timeout=3600.0), TF2Error.INVALID_ARGUMENT_ERROR),
])
def test_what_can_never_be_is_not_waited_for(asker, buffer, wanted, code):
    move(buffer, 30.0)
    move(buffer, 30.0)
    status, result = asker.ask(wanted)
    assert status == ABORTED
    assert result.error.error == code


def test_timeouts_go_by_the_buffers_clock(asker, serve, listen, make_node, sim_clock):
    node = make_node('hearing', **SIM_TIME)
    buffer = listen(node)
    sim_clock.show(10.0, buffer)
    serve(buffer)
    asker.until_served()
    _, future = asker.send(goal(seconds=11.0, timeout=5.0))
    until_waiting(buffer)
    sim_clock.show(14.0, buffer)
    assert not future.done()
    sim_clock.show(15.0, buffer)
    assert 'waited 5.000 s' in settled(future).result.error.error_string


def test_answers_come_from_the_executor_not_from_who_delivers_transforms(
        asker, buffer, make_node, spin, monkeypatch):
    threads = []
    answer = BufferServer._answer

    def note(self, handle):
        threads.append(threading.current_thread())
        return answer(self, handle)

    monkeypatch.setattr(BufferServer, '_answer', note)
    node = make_node('serving')
    with BufferServer(buffer, node):
        spin(node)
        asker.until_served()
        _, future = asker.send(goal(seconds=3.0, timeout=PATIENCE_S))
        until_waiting(buffer)
        move(buffer, 3.0)
        settled(future)
    assert threads[0] is not threading.current_thread()


# --- cancelling and ending


@pytest.mark.usefixtures('server')
def test_cancelled_goal_waits_no_longer(asker, buffer):
    handle, future = asker.send(goal(seconds=3.0, timeout=3600.0))
    other, _ = asker.send(goal(seconds=4.0, timeout=3600.0))
    until_waiting(buffer, 2)
    response = settled(handle.cancel_goal_async())
    assert [bytes(each.goal_id.uuid) for each in response.goals_canceling] == [
        bytes(handle.goal_id.uuid)]
    response = settled(future)
    assert response.status == CANCELED
    assert response.result.error.error == TF2Error.TRANSFORM_ERROR
    assert len(buffer.waiting) == 1
    settled(other.cancel_goal_async())


@pytest.mark.usefixtures('server')
def test_goal_that_was_answered_cannot_be_cancelled(asker):
    handle, future = asker.send(goal())
    settled(future)
    assert not settled(handle.cancel_goal_async()).goals_canceling


def test_closed_server_is_gone_and_holds_nothing(server, asker, buffer):
    asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    server.close()
    server.close()
    assert len(buffer.waiting) == 0
    until(lambda: not asker.client.server_is_ready())


def test_goals_are_freed_after_the_last_use_of_the_server(server, asker, buffer):
    asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    with server._server:  # as in an executor
        server.close()
        assert server._server._detached, 'rcl still reads the goal'
    until(lambda: not server._server._detached)
    until(lambda: not asker.client.server_is_ready())


def test_what_cannot_be_answered_any_more_is_no_complaint(asker, buffer, make_node, spin, capfd):
    node = make_node('serving')
    executor = spin(node)
    with BufferServer(buffer, node) as server:
        asker.until_served()
        asker.send(goal(seconds=3.0, timeout=3600.0))
        until_waiting(buffer)
        executor.remove_node(node)
        buffer.waiting.fail(TransformException('the test is over'))
    server._lookups.clear()
    assert 'never retrieved' not in capfd.readouterr().err


def test_closing_under_a_busy_executor_leaves_it_alone(asker, buffer, make_node, spin, kind):
    """The action server of rclpy sometimes makes the executor's spin raise an exception."""
    executor = spin(make_node('idle'), kind=kind)
    for number in range(20):
        node = make_node(f'serving_{number}')
        executor.add_node(node)
        server = BufferServer(buffer, node)
        asker.until_served()
        futures = [asker.client.send_goal_async(goal(timeout=1.0)) for _ in range(5)]
        settled(futures[0])
        server.close()
        executor.remove_node(node)
        until(lambda: not asker.client.server_is_ready())
    alive = executor.create_task(lambda: 'alive')
    assert settled(alive) == 'alive'


def test_server_whose_node_is_gone_takes_the_arrival_quietly(asker, buffer, make_node, spin):
    node = make_node('serving')
    server = BufferServer(buffer, node)
    executor = spin(node)
    asker.until_served()
    asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    executor.remove_node(node)
    node.destroy_node()
    move(buffer, 3.0)
    server.close()
