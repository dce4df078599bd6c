# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buffer server, called by rclpy's own action client like tf2's clients."""

from contextlib import ExitStack
import re
import threading

from action_clients import close_race
from action_msgs.msg import GoalStatus
from inputs import for_each
import numpy as np
import pytest
from rclpy.action import ActionClient, ActionServer
from rclpy.action.server import ServerGoalHandle
from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from ros_helpers import at, lasting, move, PATIENCE_S, result_of, transform, until, until_waiting
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error
from tf_tree_py import TransformException
from tf_tree_py.ros.remote import buffer_server
from tf_tree_py.ros.remote.buffer_server import BufferServer, ClosableServer

SUCCEEDED, ABORTED, CANCELED = (
    GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_CANCELED)


def goal(source='base', seconds=1.5, timeout=0.0, target='map', **fields):
    return LookupTransform.Goal(
        target_frame=target, source_frame=source, source_time=at(seconds).to_msg(),
        timeout=lasting(timeout).to_msg(), **fields)


class Asker:
    """rclpy's client, with the results of its goals."""

    def __init__(self, node):
        self.client = close_race(ActionClient(node, LookupTransform, 'tf2_buffer_server'))

    def send(self, wanted):
        """Return the handle of an accepted goal, and the future of its result."""
        handle = result_of(self.client.send_goal_async(wanted))
        assert handle.accepted
        return handle, handle.get_result_async()

    def ask(self, wanted):
        """Return the status and the result."""
        response = result_of(self.send(wanted)[1])
        return response.status, response.result


@pytest.fixture(params=[SingleThreadedExecutor, MultiThreadedExecutor])
def of_type(request):
    return request.param


@pytest.fixture
def serve(make_node, spin, asker):
    """Return a function that serves a buffer until the end of the test."""
    with ExitStack() as servers:
        def begin(buffer, of_type=SingleThreadedExecutor):
            node = make_node('serving')
            server = servers.enter_context(BufferServer(buffer, node))
            executor = spin(node, of_type=of_type)
            until(asker.client.server_is_ready)
            return server, node, executor

        yield begin


@pytest.fixture
def asker(make_node, spin):
    node = make_node('asking')
    asker = Asker(node)
    # Not before: Kilted's ActionClient joins its node before it has its lock, and the executor
    # that finds it so ends.
    spin(node)
    yield asker
    # It would keep its node, and the node its participant, until garbage is collected.
    asker.client.destroy()


@pytest.fixture
def server(buffer, serve, of_type):
    return serve(buffer, of_type)[0]


# --- results


@pytest.mark.usefixtures('server')
def test_goals_are_answered_as_soon_as_they_can_be(asker, buffer):
    status, result = asker.ask(goal())
    assert (status, result.error) == (SUCCEEDED, TF2Error())
    assert result.transform == transform('map', 'base', 1.5, x=1.5, w=1.0)
    status, result = asker.ask(goal(seconds=2.0, target='base', advanced=True, fixed_frame='map',
                                    target_time=at(1.0).to_msg()))
    assert (status, result.error) == (SUCCEEDED, TF2Error())
    assert result.transform == transform('base', 'base', 1.0, x=1.0, w=1.0)
    futures = {seconds: asker.send(goal(seconds=seconds, timeout=PATIENCE_S))[1]
               for seconds in (5.0, 4.0, 3.0)}
    until_waiting(buffer, 3)
    assert not any(future.done() for future in futures.values())
    for seconds in (3.0, 4.0, 5.0):
        move(buffer, seconds)
        response = result_of(futures[seconds])
        assert response.status == SUCCEEDED
        assert response.result.transform.transform.translation.x == seconds


@pytest.mark.usefixtures('server')
@for_each(case=[
    (goal('nowhere'), TF2Error.LOOKUP_ERROR, 'nowhere.*does not exist'),
    (goal('tree'), TF2Error.CONNECTIVITY_ERROR, 'not part of the same tree'),
    (goal(seconds=3.0), TF2Error.EXTRAPOLATION_ERROR, 'into the future'),
    (goal(seconds=0.5), TF2Error.EXTRAPOLATION_ERROR, 'into the past'),
    (goal(''), TF2Error.INVALID_ARGUMENT_ERROR, 'Invalid argument source_frame'),
    # What can never be is not waited for.
    (goal('old', seconds=1.0, timeout=3600.0), TF2Error.EXTRAPOLATION_ERROR, 'into the past'),
    (goal('/base', timeout=3600.0), TF2Error.INVALID_ARGUMENT_ERROR, 'Invalid argument source'),
    (goal(seconds=3.0, timeout=0.03), TF2Error.TIMEOUT_ERROR, 'future.*map -> base.*waited'),
])
def test_failure_is_an_answer_with_its_code_and_the_reason(asker, buffer, case):
    """Without a timeout the goal succeeds with the error as its result, as with tf2's server."""
    wanted, code, text = case
    buffer.set_transform(transform('island', 'tree', 1.5), 'me')
    for _ in range(2):
        buffer.set_transform(transform('map', 'old', 30.0), 'me')
    status, result = asker.ask(wanted)
    assert status == (ABORTED if wanted.timeout != lasting(0.0).to_msg() else SUCCEEDED)
    assert result.error.error == code
    assert re.search(text, result.error.error_string)
    waited = re.search(r'waited (\d+\.\d{3}) s', result.error.error_string)
    assert waited is None if code != TF2Error.TIMEOUT_ERROR else float(waited[1]) >= 0.03


def test_answers_come_from_the_executor_not_from_who_delivers_transforms(
        asker, buffer, serve, monkeypatch):
    threads, succeed = [], ServerGoalHandle.succeed

    def note(handle):
        threads.append(threading.current_thread())
        succeed(handle)

    monkeypatch.setattr(ServerGoalHandle, 'succeed', note)
    serve(buffer)
    _, future = asker.send(goal(seconds=3.0, timeout=PATIENCE_S))
    until_waiting(buffer)
    move(buffer, 3.0)
    result_of(future)
    assert threads[0] is not threading.current_thread()


# --- cancelling and ending


@pytest.mark.usefixtures('server')
def test_goal_can_be_cancelled_until_it_is_answered(asker, buffer):
    handle, future = asker.send(goal(seconds=3.0, timeout=3600.0))
    other, answer = asker.send(goal(seconds=4.0, timeout=3600.0))
    until_waiting(buffer, 2)
    response = result_of(handle.cancel_goal_async())
    assert [bytes(each.goal_id.uuid) for each in response.goals_canceling] == [
        bytes(handle.goal_id.uuid)]
    response = result_of(future)
    assert response.status == CANCELED
    assert response.result.error.error == TF2Error.TRANSFORM_ERROR
    assert len(buffer.waiting) == 1
    move(buffer, 4.0)
    result_of(answer)
    assert not result_of(other.cancel_goal_async()).goals_canceling


def test_cancelling_is_refused_once_the_answer_is_known(asker, buffer, serve, monkeypatch):
    ended, execute = [], ServerGoalHandle.execute
    monkeypatch.setattr(ServerGoalHandle, 'execute', lambda handle: ended.append(handle))
    *_, executor = serve(buffer)
    handle, future = asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    move(buffer, 3.0)
    until(lambda: ended)
    assert not result_of(handle.cancel_goal_async()).goals_canceling
    executor.create_task(execute, *ended)
    assert result_of(future).status == SUCCEEDED


def action_of(node):
    """Return the action server of a node, as an executor finds it."""
    (server,) = [each for each in node.waitables if isinstance(each, ClosableServer)]
    return server


def kept_goals(action):
    """Return the memory of goals that a closed action server keeps because rcl reads it."""
    return action._detached


def test_goals_of_a_closed_server_are_freed_after_its_last_use(serve, asker, buffer, of_type):
    server, node, _ = serve(buffer, of_type)
    asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    action = action_of(node)
    with action:  # as in an executor
        server.close()
        server.close()
        assert len(buffer.waiting) == 0
        assert kept_goals(action), 'rcl still reads the goal'
    until(lambda: not kept_goals(action))
    until(lambda: not asker.client.server_is_ready())


def test_goals_of_a_server_that_is_closed_while_an_executor_enters_are_freed(
        serve, asker, buffer, of_type, pool, monkeypatch):
    server, node, executor = serve(buffer, of_type)
    asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    action, is_entering, may_enter = action_of(node), threading.Event(), threading.Event()
    enter = ActionServer.__enter__

    def enter_late(each):
        is_entering.set()
        may_enter.wait(PATIENCE_S)
        return enter(each)

    with action:
        server.close()
        # The executor has left it when it runs a task.
        result_of(executor.create_task(lambda: None))
        # Another one is about to enter it, and finds that it is destroyed.
        monkeypatch.setattr(ActionServer, '__enter__', enter_late)
        entered = pool.submit(action.__enter__)
        assert is_entering.wait(PATIENCE_S)
    assert kept_goals(action)
    may_enter.set()
    with pytest.raises(InvalidHandle):
        entered.result(PATIENCE_S)
    assert not kept_goals(action)
    until(lambda: not asker.client.server_is_ready())


def test_closing_under_a_busy_executor_leaves_it_alone(asker, buffer, make_node, spin, of_type):
    """The action server of rclpy sometimes makes the executor's spin raise an exception."""
    executor = spin(make_node('idle'), of_type=of_type)
    for number in range(20):
        node = make_node(f'serving_{number}')
        executor.add_node(node)
        server = BufferServer(buffer, node)
        until(asker.client.server_is_ready)
        futures = [asker.client.send_goal_async(goal(timeout=1.0)) for _ in range(5)]
        result_of(futures[0])
        server.close()
        executor.remove_node(node)
        until(lambda: not asker.client.server_is_ready())
    assert result_of(executor.create_task(lambda: 'alive')) == 'alive'


@pytest.mark.parametrize('gone', [False, True], ids=['no executor', 'no node'])
def test_what_can_no_longer_be_answered_is_no_complaint(asker, buffer, serve, capfd, gone):
    server, node, executor = serve(buffer)
    asker.send(goal(seconds=3.0, timeout=3600.0))
    until_waiting(buffer)
    executor.remove_node(node)
    if gone:
        node.destroy_node()
        move(buffer, 3.0)
    else:
        buffer.waiting.fail(TransformException('the test is over'))
    server.close()
    server._lookups.clear()
    assert 'never retrieved' not in capfd.readouterr().err


# --- clients that break the rules


def request_of(number, wanted):
    """Return a request with the same id as other goals with this number."""
    request = LookupTransform.Impl.SendGoalService.Request(goal=wanted)
    request.goal_id.uuid = np.full(16, number, np.uint8)
    return request


def test_id_of_an_expired_goal_may_be_used_again(asker, buffer, serve, make_node, spin,
                                                 monkeypatch):
    """Otherwise one client could end the executor of the server."""
    monkeypatch.setattr(buffer_server, 'RESULT_TIMEOUT_S', 0.01)
    server, _, executor = serve(buffer)
    node = make_node('repeating')
    client = node.create_client(
        LookupTransform.Impl.SendGoalService, 'tf2_buffer_server/_action/send_goal')
    spin(node)
    until(client.service_is_ready)
    accepted = 0
    while accepted < 20:
        requests = [client.call_async(request_of(7, goal())) for _ in range(10)]
        accepted += sum(result_of(each).accepted for each in requests)
    assert result_of(executor.create_task(lambda: 'alive')) == 'alive'
    # A busy machine may ask for a result after it has expired.
    until(lambda: asker.ask(goal())[0] == SUCCEEDED)


def test_expired_goals_are_forgotten_before_a_new_one_is_accepted(asker, buffer, serve,
                                                                  monkeypatch):
    """They may have the same id."""
    _, node, executor = serve(buffer)
    action, order = action_of(node), []

    async def note(_, taken):
        order.extend([list(taken)] if taken else [])

    monkeypatch.setattr(ActionServer, 'execute', note)
    result_of(executor.create_task(action.execute(
        {'goal': 1, 'cancel': 2, 'result': 3, 'expired': 4})))
    assert order == [['expired'], ['goal', 'cancel', 'result']]


def test_goals_with_any_content_are_answered_and_not_logged(asker, buffer, serve, log):
    serve(buffer)
    for number in range(300):
        wanted = goal(f'frame_{number}' if number % 3 else 'x' * number, number % 5)
        # None of them waits.
        wanted.timeout.sec, wanted.timeout.nanosec = (
            (-5, 2**32 - 1), (0, 0), (-2**31, 5))[number % 3]
        wanted.source_time.sec = (5, -2**31, 2**31 - 1)[number // 2 % 3]
        wanted.advanced, wanted.fixed_frame = number % 2 == 0, f'fixed_{number}' * (number % 7 > 0)
        asker.ask(wanted)
    assert asker.ask(goal())[0] == SUCCEEDED
    assert log() == ''
