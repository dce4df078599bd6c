# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A listener receives robots through a real router, and lists those that are connected."""

from datetime import datetime, timedelta, timezone
import threading
import time

from conditions import until
from fleet_helpers import listening, message, PATIENCE_S, place, SECOND, send_first, Visits, x_of
import pytest
from tf_tree_py.bag import open_bag
from tf_tree_py.core import LookupException, UNLIMITED
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.fleet import connection, FleetError, FleetListener, roster
from tf_tree_py.recording.flight_recorder import FlightRecorder, Happened
from warned_lines import assert_warns_at_its_line
from zenoh import ext, handlers, Locality, Timestamp


def test_frames_of_all_robots_lie_below_the_shared_one(listen, robot):
    listener = listen()
    for number in (7, 8):
        one = robot(f'robot{number}')
        one.send_static(message(('base', 'fork', 0.5)))
        one.send(message(('map', 'odom', number), ('odom', 'base', 1), stamp=SECOND))
    assert x_of(listener.buffer, 'map', 'robot7/fork') == 8.5
    assert x_of(listener.buffer, 'robot7/fork', 'robot8/fork') == 1.0


def test_a_lookup_that_waits_is_woken_by_what_arrives(listen, robot):
    buffer = listen().buffer
    answers = []
    waiting = threading.Thread(target=lambda: answers.append(x_of(buffer, 'map', 'robot7/base')))
    waiting.start()
    robot('robot7').send(message(('map', 'base', 3)))
    waiting.join()
    assert answers == [3.0]


def test_each_robot_may_have_a_buffer_of_its_own(listen, robot):
    listener = listen(separate=True)
    for number in (7, 8):
        robot(f'robot{number}').send(message(('map', 'base', number)))
    assert x_of(listener['robot7'], 'map', 'base') == 7.0
    assert x_of(listener['robot8'], 'map', 'base') == 8.0
    with pytest.raises(FleetError, match="listener\\['robot7'\\]"):
        listener.buffer  # noqa: B018
    with pytest.raises(FleetError, match='cannot be the name of a robot'):
        listener['*']


def test_short_window_is_warned_of_where_it_is_given():
    assert_warns_at_its_line(lambda: FleetListener('tcp/127.0.0.1:1', cache_time=10).close())


def test_who_has_one_buffer_is_told_so(listen):
    with pytest.raises(FleetError, match='separate=True'):
        listen()['robot7']


def test_history_beyond_a_channel_does_not_stop_a_late_listener(
        listen, robot, session, hall, monkeypatch):
    """The past arrives while Zenoh still declares the subscription that has requested it."""
    one, now = robot('robot7', history=100), time.time_ns()
    for number in range(100):
        one.send(message(('map', 'base', number), stamp=now + number))
    declare, waited = ext.declare_advanced_subscriber, []

    def declare_slowly(session, key, *arguments, **options):

        def wait(_):
            """Wait for a reply of the robot's session to a later request."""
            if key == f'{hall}/*/tf' and not waited:
                waited.extend(session.get(f'{hall}/echo', handlers.FifoChannel(1)))

        with session.declare_queryable(
                f'{key}/@adv/**', handlers.Callback(wait, indirect=False),
                allowed_origin=Locality.SESSION_LOCAL):
            return declare(session, key, *arguments, **options)

    monkeypatch.setattr(connection, 'WAITING', 1)
    monkeypatch.setattr(ext, 'declare_advanced_subscriber', declare_slowly)
    with session.declare_queryable(f'{hall}/echo', handlers.Callback(
            lambda query: query.reply(query.key_expr, b''), indirect=False)):
        buffer = listen().buffer
        assert buffer.lookup_within(PATIENCE_S, 'map', 'robot7/base', now + 99).x == 99.0
    assert waited


def test_program_that_ends_while_the_past_arrives_can_close_the_listener(
        listen, robot, monkeypatch, caplog):
    """Python starts no more threads then, so nothing takes the messages out of the channel."""
    one, begin = robot('robot7', history=100), connection.WorkerThreads.receive_all
    for number in range(100):
        one.send(message(('map', 'base', number), stamp=SECOND + number))

    def receive_all(self, handler, receive, what):
        if what.endswith('/tf'):
            raise RuntimeError("can't create new thread at interpreter shutdown")
        begin(self, handler, receive, what)

    monkeypatch.setattr(connection, 'WAITING', 1)
    monkeypatch.setattr(connection.WorkerThreads, 'receive_all', receive_all)
    listener = listen(cache_time=UNLIMITED)
    until(lambda: 'cannot receive' in caplog.text)
    listener.close()


def test_a_late_listener_has_all_statics_and_the_last_seconds_at_once(listen, robot):
    one, now = robot('robot7', history=5), 1_700_000_000 * SECOND
    one.send_static(message(('base', 'camera', 1), ('base', 'fork', 2)))
    for number in range(8):
        one.send(message(('map', 'base', number), stamp=now + number * SECOND))
    buffer = listen().buffer
    assert x_of(buffer, 'robot7/base', 'robot7/fork') == 2.0
    # The last five are cached; they may arrive in any order.
    for second in range(3, 8):
        assert buffer.lookup_within(
            PATIENCE_S, 'map', 'robot7/camera', now + second * SECOND).x == second + 1.0
    assert min(info.oldest for info in buffer.edges() if not info.static) == now + 3 * SECOND


def test_robots_come_and_go_by_their_tokens(listen, robot):
    visits = Visits()
    listener = listen(on_robot=visits)
    first = robot('robot7')
    assert visits.wait() == ('robot7', True)
    first.close()
    assert visits.wait() == ('robot7', False)
    until(lambda: not listener.robots()[0].here)
    robot('robot7')
    assert visits.wait() == ('robot7', True) and listener.robots()[0].here


def test_robots_are_told_with_their_rate_lag_and_counts(listen, robot):
    listener = listen()
    one = robot('robot7')
    send_first(listener, one, b'no message')
    one.send_static(message(('base', 'fork', 2)))
    for _ in range(5):
        one.send(message(('map', 'base', 1), ('base', 'arm', 1)))
    for _ in range(4):
        one.send(b'no message')
    until(lambda: listener.robots()[0].transforms == 11 and listener.robots()[0].refused == 5)
    (told,) = listener.robots()
    assert (told.name, told.here, told.transforms, told.refused) == ('robot7', True, 11, 5)
    assert told.lost == told.recovered == 0
    assert told.as_dict()['name'] == 'robot7'
    for _ in range(3):
        one.send(message(('map', 'base', 1)))
    until(lambda: listener.robots()[0].transforms == 14)
    (told,) = listener.robots()
    assert told.rate_hz > 0.0 and 0 <= told.lag < PATIENCE_S * SECOND and told.silence >= 0


def test_only_robots_that_are_meant_are_heard(listen, robot, session, hall):
    visits = Visits()
    listener = listen(['forklift*', 'robot7'], on_robot=visits)
    token = session.liveliness().declare_token(
        f'@/{session.zid()}/@ros2_lv/MP/{hall}§robot6§tf/tf2_msgs§msg§TFMessage/:::')
    for name in ('robot7', 'robot8', 'forklift1'):
        robot(name).send(message(('map', 'base', 1)))
    session.put(f'{hall}/robot9/tf', message(('map', 'base', 1)))
    for name in ('robot7', 'forklift1'):
        x_of(listener.buffer, 'map', f'{name}/base')
    assert [one.name for one in listener.robots()] == ['forklift1', 'robot7']
    assert {visits.wait(), visits.wait()} == {('robot7', True), ('forklift1', True)}
    assert not visits.so_far()
    token.undeclare()


def test_a_robot_with_a_slow_clock_has_a_rate_and_a_lag(listen, robot, session, hall, monkeypatch):
    monkeypatch.setattr(roster, 'CATCH_UP', 0)
    listener = listen()

    def send():
        now = session.new_timestamp()
        slow = Timestamp(now.get_time() - timedelta(hours=1), now.get_id())
        session.put(f'{hall}/robot7/tf', message(('map', 'base', 1)), timestamp=slow)

    until(lambda: send() or (listener.robots() and listener.robots()[0].rate_hz))
    assert listener.robots()[0].recovered == 0 and listener.robots()[0].lag < PATIENCE_S * SECOND


def test_robot_with_a_wrong_clock_leaves_the_flight_recorder_alone(
        listen, robot, session, hall, tmp_path):
    recorder = FlightRecorder(tmp_path)
    listener = listen(observers=[recorder])
    robot('robot8').send(message(('map', 'base', 8)))
    x_of(listener.buffer, 'map', 'robot8/base')

    def send():
        now = session.new_timestamp()
        wrong = Timestamp(datetime.fromtimestamp(5, timezone.utc), now.get_id())
        session.put(f'{hall}/robot7/tf', message(('map', 'base', 7), stamp=5 * SECOND),
                    timestamp=wrong)

    until(lambda: send() or 'robot7/base' in listener.buffer.frames())
    path = recorder.write(Happened('asked', 'by a test'))
    assert set(open_bag(path).frames()) == {'map', 'robot7/base', 'robot8/base'}


def test_nothing_listens_beyond_this_machine(listen, robot):
    # ROS, if tests of it ran in this process.
    before = {place for place in listening() if place[0] != '0100007F' or place[2] != 'tcp'}
    robot('robot7').send(message(('map', 'base', 1)))
    x_of(listen().buffer, 'map', 'robot7/base')
    # The router of these tests listens here.
    places = listening() - before
    assert {(address, protocol) for address, _, protocol in places} == {('0100007F', 'tcp')}


# --- watching, and ending

class Heard(Observer):

    def __init__(self):
        self.messages = []

    def received(self, arrival):
        self.messages.append(arrival)


def test_who_watches_hears_whole_messages_with_their_key_and_robot(listen, robot, hall):
    listener, heard = listen(), Heard()
    listener.buffer.observers.add(heard)
    robot('robot7').send_static(message(('base', 'fork', 2)))
    x_of(listener.buffer, 'robot7/base', 'robot7/fork')
    (arrival,) = heard.messages
    assert (arrival.topic, arrival.static, arrival.authority) == (
        f'{hall}/robot7/tf_static', True, 'robot7')
    assert arrival.batch.edges == (('robot7/base', 'robot7/fork'),)


def test_what_on_robot_raises_ends_nothing(listen, robot, caplog):
    def on_robot(name, here):
        raise RuntimeError('mine')

    listener = listen(on_robot=on_robot)
    for number in (7, 8):
        robot(f'robot{number}').send(message(('map', 'base', number)))
        x_of(listener.buffer, 'map', f'robot{number}/base')
    until(lambda: caplog.text.count('RuntimeError: mine') == 2)


def test_a_listener_may_be_closed_anywhere_and_twice_and_keeps_what_it_has(listen, robot):
    closed = threading.Event()

    def on_robot(name, here):
        listener.close()
        closed.set()

    listener = listen()
    one = robot('robot7')
    one.send(message(('map', 'base', 7)))
    x_of(listener.buffer, 'map', 'robot7/base')
    listener.close()
    listener.close()
    assert not any(thread.name == 'fleet' for thread in threading.enumerate())
    assert listener.buffer.lookup('map', 'robot7/base') == place(7)
    listener = listen(on_robot=on_robot)
    assert closed.wait(PATIENCE_S)


def test_a_listener_without_a_router_waits_for_one_and_can_be_closed(impatient, caplog):
    with FleetListener('tcp/127.0.0.1:9') as listener:
        until(lambda: 'yet, retrying' in caplog.text)
        assert not listener.connected
        with pytest.raises(LookupException):
            listener.buffer.lookup_within(0.01, 'map', 'robot7/base')
    assert caplog.text.count('yet, retrying') == 1


@pytest.mark.parametrize(('options', 'problem'), [
    ({'robots': []}, 'no robots'),
    ({'robots': 'a//b'}, 'cannot match a robot'),
    ({'shared_frames': 'map'}, "such as \\('map',\\)"),
    ({'key_prefix': '*'}, 'cannot be the prefix'),
    ({'connect': 'hall'}, 'not the address of a router'),
    ({'connect': 7447}, 'not the address of a router'),
    ({'robots': 7}, 'robots has to be a name or a pattern'),
    ({'robots': [7]}, 'robots has to be a name or a pattern'),
    ({'on_robot': 'print'}, 'on_robot has to be a function'),
    ({'connect': None}, 'nothing to connect to'),
])
def test_wrong_arguments_are_named_at_once(options, problem):
    with pytest.raises(FleetError, match=problem):
        FleetListener(**{'connect': 'tcp/127.0.0.1:9', **options})
