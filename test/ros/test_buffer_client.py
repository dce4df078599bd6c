# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The buffer client, with our server and with one that behaves like tf2's."""

from concurrent.futures import CancelledError
from contextlib import contextmanager
import gc
import threading

from action_msgs.srv import CancelGoal
from conditions import until
from geometry_msgs.msg import PointStamped
from inputs import for_each
import pytest
from rclpy.action import CancelResponse, GoalResponse
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from ros_helpers import (
    at,
    lasting,
    LATEST,
    move,
    PATIENCE,
    PATIENCE_S,
    result_of,
    until_waiting,
    x_of,
)
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TF2Error
import tf_tree_py as tf
from tf_tree_py.ros.remote import buffer_client, buffer_server, goal_client, lookup_goal
from tf_tree_py.ros.remote.buffer_client import BufferClient
from tf_tree_py.ros.remote.buffer_server import BufferServer, ClosableServer
from tf_tree_py.ros.remote.lookup_goal import State, UNACCEPTED, WANTED
from unique_identifier_msgs.msg import UUID

ACTION = 'tf2_buffer_server'


@pytest.fixture
def serve(make_node, spin):
    """Return a context manager that serves a buffer."""
    @contextmanager
    def begin(buffer, **options):
        node = make_node('serving', **options)
        with BufferServer(buffer, node, ACTION) as server:
            spin(node)
            yield server

    return begin


@pytest.fixture
def server(buffer, serve):
    with serve(buffer) as server:
        yield server


@pytest.fixture
def deaf(client, make_node):
    """Make a server whose node does not spin, with a client that gives it little time."""
    server = ClosableServer(make_node('deaf'), LookupTransform, ACTION, lambda _: None)
    client.timeout_padding = lasting(0.0)
    assert client.wait_for_server(PATIENCE)
    yield
    server.destroy()


@pytest.fixture
def pending(monkeypatch):
    """Return a function that returns the requests whose responses are still expected."""
    services, create = [], Node.create_client
    monkeypatch.setattr(Node, 'create_client', lambda *service, **options: services.append(
        create(*service, **options)) or services[-1])
    return lambda: [request for each in services for request in each._pending_requests]


@pytest.fixture
def make_client(node, pending):
    """Make clients that are closed at the end of the test."""
    clients = []

    def make(node=node, name=ACTION, **options):
        clients.append(BufferClient(node, name, **options))
        return clients[-1]

    yield make
    for client in clients:
        client.close()
        assert not client.action_client.goals_in(*WANTED)


@pytest.fixture
def client(make_client):
    # No answer of a busy server is late.
    return make_client(check_frequency=50.0, timeout_padding=PATIENCE)


@pytest.fixture
def ready(server, client):
    """Return a client whose server is available."""
    assert client.wait_for_server(PATIENCE)
    return client


class Forgetful(ClosableServer):
    """A server that no longer knows some of its goals when it is asked for their results."""

    def __init__(self, forgotten, *args, **options):
        self.forgotten = forgotten
        super().__init__(*args, **options)

    async def execute(self, taken_data):
        if 'result' in taken_data:
            request = taken_data['result'][1]
            if bytes(request.goal_id.uuid) in self.forgotten:
                request.goal_id = UUID()
        await super().execute(taken_data)


class OtherServer:
    """A server whose responses the test chooses, as of another implementation."""

    def __init__(self, node):
        self.accepts, self.forgets, self.forgotten = True, 0, set()
        self.status, self.result = 'abort', LookupTransform.Result()
        self.may_answer = threading.Event()
        self.may_answer.set()
        self.handles = []
        self.server = Forgetful(
            self.forgotten, node, LookupTransform, ACTION, self._execute,
            goal_callback=lambda _: GoalResponse.ACCEPT if self.accepts else GoalResponse.REJECT,
            handle_accepted_callback=self._accept,
            cancel_callback=lambda _: CancelResponse.ACCEPT)

    def _accept(self, handle):
        if self.forgets:
            self.forgets -= 1
            self.forgotten.add(bytes(handle.goal_id.uuid))
        else:
            handle.execute()

    def is_canceled(self):
        return any(handle.is_cancel_requested for handle in self.handles)

    def _execute(self, handle):
        self.handles.append(handle)
        self.may_answer.wait(PATIENCE_S)
        if handle.is_cancel_requested:
            handle.canceled()
        else:
            getattr(handle, self.status)()
        return self.result

    def close(self):
        self.may_answer.set()
        self.server.destroy()


@pytest.fixture
def other(make_node, spin, client):
    node = make_node('other')
    other = OtherServer(node)
    spin(node, of_type=MultiThreadedExecutor)
    assert client.wait_for_server(PATIENCE)
    yield other
    other.close()


# --- results


def test_answers_are_those_of_the_buffer(ready, buffer, pool):
    assert ready.lookup_transform('map', 'base', at(1.5)) == buffer.lookup_transform(
        'map', 'base', at(1.5))
    assert ready.lookup_transform('map', 'base', LATEST).header.stamp == at(2.0).to_msg()
    assert ready.lookup_transform('map', 'base', at(1.5).to_msg()).header.stamp.sec == 1
    full = 'base', at(1.0), 'base', at(2.0), 'map'
    assert ready.lookup_transform_full(*full) == buffer.lookup_transform_full(*full)
    assert x_of(ready.lookup_transform_full(*full)) == 1.0
    point = PointStamped()
    point.header.frame_id, point.header.stamp = 'base', at(1.5).to_msg()
    assert ready.transform(point, 'map').point.x == 1.5
    asked = pool.submit(ready.lookup_transform, 'map', 'base', at(3.0), PATIENCE)
    until_waiting(buffer)
    move(buffer, 3.0)
    assert x_of(result_of(asked)) == 3.0


def test_can_transform_says_yes_or_no_and_why(ready):
    assert ready.can_transform('map', 'base', at(1.5)) is True
    assert ready.can_transform('map', 'base', at(3.0)) is False
    full = 'base', at(1.0), 'base', at(2.0), 'map'
    assert ready.can_transform_full(*full) is True
    assert ready.can_transform_full(*full, return_debug_tuple=True) == (True, '')
    assert ready.can_transform_full('base', at(1.0), 'base', at(3.0), 'map') is False
    found, why = ready.can_transform('map', 'nowhere', LATEST, return_debug_tuple=True)
    assert found is False
    assert '"nowhere"' in why


@pytest.mark.parametrize('of_type', [SingleThreadedExecutor, MultiThreadedExecutor])
def test_executor_waits_in_a_callback_and_awaits_in_coroutines(ready, buffer, node, spin, of_type):
    """Although the callback blocks the only thread of the node's executor."""
    executor = spin(node, of_type=of_type)
    blocking = executor.create_task(ready.lookup_transform, 'map', 'base', at(1.5), PATIENCE)
    assert x_of(result_of(blocking)) == 1.5
    tasks = [
        executor.create_task(ready.lookup_transform_async, 'map', 'base', at(3.0)),
        executor.create_task(ready.lookup_transform_full_async(
            'base', at(1.0), 'base', at(3.0), 'map', PATIENCE))]
    until_waiting(buffer, 2)
    move(buffer, 3.0)
    assert [x_of(result_of(task)) for task in tasks] == [3.0, 2.0]


def test_namespace_and_remapping_are_those_of_the_node(buffer, make_node, make_client, serve):
    remap = f'buffers/_action/{{0}}:=/robot/{ACTION}/_action/{{0}}'
    rules = [each for service in ('send_goal', 'get_result', 'cancel_goal')
             for each in ('-r', remap.format(service))]
    with serve(buffer, namespace='/robot'):
        for client in (
                make_client(make_node('asking', namespace='/robot')),
                make_client(make_node('elsewhere'), f'/robot/{ACTION}'),
                make_client(make_node('remapped', cli_args=['--ros-args', *rules]), 'buffers')):
            assert client.wait_for_server(PATIENCE)
            assert x_of(client.lookup_transform('map', 'base', at(1.5))) == 1.5


# --- errors


ERRORS = {
    TF2Error.LOOKUP_ERROR: tf.LookupException,
    TF2Error.CONNECTIVITY_ERROR: tf.ConnectivityException,
    TF2Error.EXTRAPOLATION_ERROR: tf.ExtrapolationException,
    TF2Error.INVALID_ARGUMENT_ERROR: tf.InvalidArgumentException,
    TF2Error.TIMEOUT_ERROR: tf.TimeoutException,
    TF2Error.TRANSFORM_ERROR: tf.TransformException,
    99: tf.TransformException,
}


@for_each(code=ERRORS, status=['succeed', 'abort'])
def test_code_of_an_error_becomes_its_exception(other, client, code, status):
    other.status = status
    other.result.error = TF2Error(error=code, error_string='so it is')
    with pytest.raises(tf.TransformException, match='so it is') as raised:
        client.lookup_transform('map', 'base', LATEST)
    assert type(raised.value) is ERRORS[code]


@for_each(timeout=[lasting(0.01), None, PATIENCE])
def test_timeout_of_tf2s_server_is_believed_at_once(other, client, timeout):
    """It aborts the goal with an empty result, a known problem of tf2's own client."""
    counts = []
    # DDS drops the response to the first goal if the server has not discovered the client yet.
    for _ in range(2):
        with pytest.raises(tf.TimeoutException, match='did not find the transform in time'):
            client.lookup_transform('map', 'base', LATEST, timeout)
        counts.append(len(other.handles))
    assert counts[1] == counts[0] + 1


def test_goal_that_somebody_else_canceled_is_no_identity(other, client, make_node, pool):
    other.may_answer.clear()
    asked = pool.submit(client.lookup_transform, 'map', 'base', LATEST, PATIENCE)
    until(lambda: other.handles)
    cancel = make_node('somebody').create_client(CancelGoal, f'{ACTION}/_action/cancel_goal')
    until(cancel.service_is_ready)
    cancel.call_async(CancelGoal.Request())  # all goals
    until(other.is_canceled)
    other.may_answer.set()
    with pytest.raises(tf.TransformException, match='canceled at the buffer server'):
        result_of(asked)


def test_goal_that_is_not_accepted_says_so(other, client):
    other.accepts = False
    with pytest.raises(tf.TimeoutException, match='did not accept the goal'):
        client.lookup_transform('map', 'base', LATEST, PATIENCE)


def test_goal_that_no_server_knows_is_asked_again_in_its_time(other, make_client):
    # The same happens if a request arrives just after another server accepted the goal.
    # It would not be given up before the last server has answered, however busy that is.
    client = make_client(check_frequency=0.1, timeout_padding=0.5)
    until(client.action_client.server_is_ready)
    other.forgets, other.status = 3, 'succeed'
    client.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert len(other.handles) == 1
    other.forgets = 1_000_000
    with pytest.raises(tf.TransformException, match='no longer knows the goal'):
        client.lookup_transform('map', 'base', LATEST)


@pytest.mark.parametrize('check_frequency', [0.0, -1.0, float('nan'), float('inf'), 1e-300])
def test_what_is_no_frequency_is_refused(make_client, check_frequency):
    with pytest.raises(ValueError, match='check_frequency=.* from 1e-9 to 1e9 Hz$'):
        make_client(check_frequency=check_frequency)


def test_missing_server_is_told_at_once_or_after_the_timeout(make_client, client):
    # The next check is in an hour, and no response is late before that.
    patient = make_client(check_frequency=1.0 / 3600.0, timeout_padding=lasting(3600.0))
    with pytest.raises(tf.TimeoutException, match=f'There is no buffer server /{ACTION}'):
        patient.lookup_transform('map', 'base', LATEST)
    assert patient.can_transform('map', 'base', LATEST) is False
    with pytest.raises(tf.TimeoutException, match=r'no buffer server.*waited \d') as raised:
        client.lookup_transform('map', 'base', LATEST, lasting(0.05))
    assert raised.value.waited_s >= 0.05
    assert not client.wait_for_server(lasting(0.02))


def test_server_that_comes_in_time_answers(client, buffer, serve, pool):
    """A call that was cancelled before is never sent."""
    call = client.wait_for_transform_async('map', 'base', at(3.0))
    call.cancel()
    asked = pool.submit(client.lookup_transform, 'map', 'base', at(1.5), PATIENCE)
    until(lambda: client.action_client.goals_in(*WANTED))
    with serve(buffer):
        assert x_of(result_of(asked)) == 1.5
    assert not call.sent


def test_server_that_hangs_is_given_up_after_the_padding_and_told_so(other, client):
    other.may_answer.clear()
    call = client.wait_for_transform_async('map', 'base', LATEST, lasting(0.05))
    until(lambda: call.accepted)
    call._padding_s = 0.05
    with pytest.raises(tf.TimeoutException, match='is available, but did not answer') as raised:
        result_of(call)
    assert raised.value.waited_s >= 0.1
    until(other.is_canceled)


@pytest.fixture
def sent(monkeypatch):
    """Return a list of the goals that are sent from now on."""
    sent = []
    goal = lookup_goal.LookupCall.goal
    monkeypatch.setattr(lookup_goal.LookupCall, 'goal',
                        lambda call: sent.append(goal(call)) or sent[-1])
    return sent


def test_long_wait_is_asked_for_in_parts(ready, buffer, sent, monkeypatch, pool):
    """So that a server can drop the goals of a client that has died."""
    monkeypatch.setattr(lookup_goal, 'LEASE_S', 0.02)
    asked = pool.submit(ready.lookup_transform, 'map', 'base', at(3.0), PATIENCE)
    until(lambda: len(sent) > 3)
    assert sent[-1].timeout.sec == 0
    move(buffer, 3.0)
    assert x_of(result_of(asked)) == 3.0
    # The text contains the server's waiting time, not that of the parts before.
    with pytest.raises(tf.TimeoutException, match=r'future.*map -> base.*waited \d'):
        ready.lookup_transform('map', 'base', at(4.0), lasting(0.05))


@pytest.fixture
def simulated(simulated_buffer, serve, client):
    """Serve a buffer with simulated time, now 10 s."""
    with serve(simulated_buffer):
        assert client.wait_for_server(PATIENCE)
        yield simulated_buffer
        until(lambda: len(simulated_buffer.waiting) == 0)


@pytest.mark.parametrize('clock', ['stands still', 'is fast'])
def test_long_wait_outlasts_a_server_with_another_clock(
        simulated, client, sent, sim_clock, monkeypatch, clock):
    if clock == 'stands still':
        monkeypatch.setattr(lookup_goal, 'LEASE_S', 0.02)
        # Longer than a busy server takes to accept a goal.
        client.timeout_padding = lasting(3.0)
    else:
        monkeypatch.setattr(lookup_goal, 'QUICK_S', 0.0)
    call = client.wait_for_transform_async('map', 'base', LATEST)
    until_waiting(simulated)
    if clock == 'is fast':
        sim_clock.show(99.0, simulated)
    until(lambda: len(sent) > 1)
    move(simulated, 3.0)
    assert x_of(result_of(call)) == 3.0


@pytest.mark.usefixtures('deaf')
def test_server_that_accepts_nothing_is_given_up(client, sent, pending, monkeypatch):
    """Also without a timeout, and when the calls are cancelled; nothing is left."""
    monkeypatch.setattr(goal_client, 'AGAIN_AT_FIRST', 0.0)
    client.timeout_padding = lasting(0.5)
    with pytest.raises(tf.TimeoutException, match='is available, but did not answer'):
        client.lookup_transform('map', 'base', LATEST)
    assert len(sent) == 1, 'not again, because its time is over'
    client.timeout_padding = lasting(0.0)
    monkeypatch.setattr(goal_client, 'DISCOVERY_S', 0.0)
    monkeypatch.setattr(lookup_goal, 'ACCEPTANCE_S', 0.02)
    call = client.wait_for_transform_async('map', 'base', LATEST)
    with pytest.raises(tf.TimeoutException, match='is available, but did not answer'):
        result_of(call)
    for _ in range(20):
        client.wait_for_transform_async('map', 'base', LATEST).cancel()
    until(lambda: not client.action_client.goals_in(*UNACCEPTED))
    assert not pending()


def test_request_that_a_new_server_lost_is_sent_again(buffer, client, serve, monkeypatch):
    """While DDS discovers a server, the request or its response may be lost."""
    monkeypatch.setattr(goal_client, 'AGAIN_AT_FIRST', 0.05)
    lost = []

    class Losing(ClosableServer):

        async def execute(self, taken_data):
            if 'goal' in taken_data and len(lost) < 2:
                lost.append(taken_data.pop('goal'))
            await super().execute(taken_data)

    monkeypatch.setattr(buffer_server, 'ClosableServer', Losing)
    with serve(buffer):
        assert x_of(client.lookup_transform('map', 'base', at(1.5), PATIENCE)) == 1.5
    assert len(lost) == 2


def test_server_gets_what_is_left_of_the_timeout(other, client):
    client.can_transform('map', 'base', LATEST, lasting(50.0))
    sent = other.handles[0].request.timeout
    assert 10.0 < sent.sec + sent.nanosec / 1e9 < 50.0


# --- cancelling and ending


def test_cancelled_calls_cancel_their_goals(ready, buffer, pending):
    """A cancel request before the acceptance would refer to an unknown goal."""
    call = ready.wait_for_transform_async('map', 'base', at(3.0))
    until_waiting(buffer)
    call.cancel()
    with pytest.raises(CancelledError):
        call.result()
    for _ in range(200):
        ready.wait_for_transform_async('map', 'base', at(3.0)).cancel()
    until(lambda: not ready.action_client.goals_in(*UNACCEPTED))
    until(lambda: len(buffer.waiting) == 0)
    # A new lookup is behind all of these.
    ready.lookup_transform('map', 'base', at(1.5), PATIENCE)
    assert len(buffer.waiting) == 0
    assert not pending()


def test_interrupted_lookup_cancels_its_goal(ready, buffer, monkeypatch):
    """As with Ctrl-C, which interrupts the main thread while it waits."""
    class Interrupted(threading.Event):

        def wait(self, timeout=None):
            until_waiting(buffer)
            raise KeyboardInterrupt

    monkeypatch.setattr(buffer_client, 'Event', Interrupted)
    with pytest.raises(KeyboardInterrupt):
        ready.lookup_transform('map', 'base', at(3.0), lasting(3600.0))
    assert not ready.action_client.goals_in(*WANTED)
    until(lambda: len(buffer.waiting) == 0)


@pytest.mark.filterwarnings('error:failed to send response')
def test_closing_ends_what_is_on_its_way(ready, buffer, node, monkeypatch):
    """The server receives the cancel requests, and can respond."""
    # As long as a server on a busy machine takes.
    monkeypatch.setattr('tf_tree_py.ros.remote.goal_client.FAREWELL_S', PATIENCE_S)
    calls = [ready.wait_for_transform_async('map', 'base', at(3.0)) for _ in range(3)]
    until_waiting(buffer, 3)
    # These are just being accepted.
    calls += [ready.wait_for_transform_async('map', 'base', at(3.0)) for _ in range(8)]
    ready.wait_for_transform_async('map', 'base', at(3.0)).cancel()
    ready.close()
    assert len(buffer.waiting) == 0
    assert not ready.action_client.goals_in(*UNACCEPTED)
    assert not ready.action_client.thread.is_alive()
    for call in calls:
        with pytest.raises(tf.TransformException, match='was closed'):
            call.result()
    ready.close()
    with pytest.raises(tf.TransformException, match='was closed'):
        ready.lookup_transform('map', 'base', at(1.5), PATIENCE)
    assert not ready.wait_for_server()
    until(lambda: not [name for name in node.get_node_names() if 'client_impl' in name])


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_end_of_ros_ends_what_is_on_its_way(ready, buffer, context, pool):
    asked = pool.submit(ready.lookup_transform, 'map', 'base', at(3.0), PATIENCE)
    until_waiting(buffer)
    context.shutdown()
    with pytest.raises(tf.TransformException, match='or ROS shut down'):
        result_of(asked)
    buffer.waiting.fail(tf.TransformException('the test is over'))


@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_end_of_ros_is_no_error_before_the_client_has_noticed(ready, context):
    going_on, in_its_thread = threading.Event(), threading.Event()

    def linger(_):
        in_its_thread.set()
        going_on.wait(PATIENCE_S)

    ready.wait_for_transform_async('map', 'base', at(1.5)).add_done_callback(linger)
    assert in_its_thread.wait(PATIENCE_S)
    context.shutdown()
    assert not ready.wait_for_server(lasting(0.0))
    with pytest.raises(tf.TimeoutException, match='or ROS shut down'):
        ready.lookup_transform('map', 'base', at(1.5))
    going_on.set()
    ready.close()


def test_client_without_a_reference_ends_its_thread(node):
    client = BufferClient(node, ACTION)
    thread = client.action_client.thread
    del client
    gc.collect()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_coroutine_that_is_collected_cancels_its_call_in_the_thread(client, context):
    async def ask():
        await client.lookup_transform_async('map', 'base', LATEST)

    executor = SingleThreadedExecutor(context=context)
    executor.create_task(ask)
    executor.spin_once(timeout_sec=0.0)
    executor.shutdown()
    del executor
    collecting = threading.Thread(target=gc.collect)
    with client.action_client._lock:
        collecting.start()
        collecting.join(PATIENCE_S)
        assert not collecting.is_alive()
    until(lambda: not client.action_client.goals_in(*WANTED))


@pytest.mark.parametrize('end', [
    lambda client: client.destroy(), lambda client: client.action_client.destroy(),
    lambda client: client.__exit__(None, None, None),
], ids=['client', 'action client', 'context manager'])
def test_destroying_as_in_tf2_closes(node, end):
    with BufferClient(node, ACTION) as client:
        assert client.action_client.thread.is_alive()
        call = client.wait_for_transform_async('map', 'base', LATEST)
        end(client)
        assert not client.action_client.thread.is_alive()
        with pytest.raises(tf.TimeoutException, match='was closed'):
            call.result()


def test_lookup_in_the_clients_own_thread_fails_instead_of_hanging(ready):
    errors = []

    def ask_more(_):
        with pytest.raises(tf.TransformException) as raised:
            ready.lookup_transform('map', 'base', at(1.5), PATIENCE)
        errors.append(raised.value)

    call = ready.wait_for_transform_async('map', 'base', at(3.0), lasting(0.01))
    call.add_done_callback(ask_more)
    until(lambda: errors)
    assert 'this thread receives the answers' in str(errors[0])


def test_burst_of_calls_is_sent_in_turns_and_leaves_nothing(
        ready, buffer, pending, monkeypatch):
    """tf2's server queues ten unprocessed goals, and drops the others. Calls need no threads."""
    home = ready.action_client
    unaccepted, report = [], home.report

    def note(*event):
        unaccepted.append(len(home.goals_in(*UNACCEPTED)))
        report(*event)

    monkeypatch.setattr(home, 'report', note)
    before = threading.active_count()
    calls = [ready.wait_for_transform_async('map', 'base', at(3.0 + number / 100.0), PATIENCE)
             for number in range(100)]
    until_waiting(buffer, 100)
    # A single thread at the server watches all deadlines.
    assert threading.active_count() <= before + 1
    move(buffer, 4.0)
    assert [x_of(result_of(call)) for call in calls] == pytest.approx(
        [3.0 + number / 100.0 for number in range(100)])
    assert max(unaccepted) <= 8
    assert not home.goals_in(*State)
    assert not pending()


def test_of_a_hundred_clients_at_once_each_is_answered(server, buffer, make_node, make_client):
    nodes = [make_node(f'asking_{number}') for number in range(10)]
    clients = [make_client(nodes[number % 10]) for number in range(100)]
    assert all(client.wait_for_server(PATIENCE) for client in clients)
    calls = [client.wait_for_transform_async('map', 'base', at(3.0), PATIENCE)
             for client in clients]
    until_waiting(buffer, 100)
    move(buffer, 3.0)
    assert [x_of(result_of(call)) for call in calls] == [3.0] * 100
