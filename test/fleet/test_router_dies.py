# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A router that dies costs only the messages meanwhile, with one log line at each change."""

from itertools import count
from threading import Event
import time
from types import SimpleNamespace

from conditions import until
from fleet_helpers import kept, message, PATIENCE_S, Router, SECOND, session_at, Visits, x_of
import pytest
from tf_tree_py.fleet import FleetListener, RobotPublisher, roster
from tf_tree_py.fleet.roster import Roster
from tf_tree_py.fleet.trust import RobotQuota

NOW = 1_700_000_000 * SECOND


@pytest.fixture
def router():
    router = Router()
    yield router
    router.kill()


def messages(caplog):
    return [record.getMessage().partition(' to ')[0] for record in caplog.records
            if record.name == 'tf_tree_py.fleet']


@pytest.fixture
def noticed(monkeypatch):
    """Return an event: a listener has noticed that a robot's token is gone."""
    event, disconnect = Event(), Roster.disconnect

    def disconnect_and_set(*arguments):
        disconnect(*arguments)
        event.set()

    monkeypatch.setattr(Roster, 'disconnect', disconnect_and_set)
    return event


def test_a_router_that_comes_back_finds_everything_as_it_was(
        router, noticed, monkeypatch, caplog):
    # However long a busy machine needs for the stored messages.
    monkeypatch.setattr(roster, 'CATCH_UP', int(PATIENCE_S * SECOND))
    visits = Visits()
    with session_at(router.endpoint) as session, \
            RobotPublisher(session, 'robot7', history=5) as robot, \
            FleetListener(router.endpoint, on_robot=visits) as listener:
        buffer = listener.buffer

        def send(numbers):
            for number in numbers:
                robot.send(message(('map', 'base', number), stamp=NOW + number * SECOND // 10))

        robot.send_static(message(('base', 'fork', 100)))
        send([0])
        assert x_of(buffer, 'map', 'robot7/fork') == 100.0
        router.kill()
        until(lambda: not listener.connected)
        assert noticed.wait(PATIENCE_S)
        # Known data stays. The robot stores what it sends meanwhile, up to its limit.
        assert buffer.lookup('map', 'robot7/fork').x == 100.0
        send(range(1, 21))
        router.start()
        buffer.lookup_within(PATIENCE_S, 'map', 'robot7/fork', NOW + 2 * SECOND)
        send([21])
        buffer.lookup_within(PATIENCE_S, 'map', 'robot7/fork', NOW + 21 * SECOND // 10)
        assert buffer.lookup('map', 'robot7/fork', NOW + 16 * SECOND // 10).x == 116.0
        until(lambda: listener.robots()[0].lost)
        (told,) = listener.robots()
        assert (told.lost, told.recovered, told.here) == (15, 5, True)
        assert visits.so_far() == [('robot7', True)]
    assert messages(caplog) == ['the connection', 'connected']


def test_messages_sent_without_a_connection_are_late(monkeypatch):
    """Tokens and messages arrive in different threads."""
    now = count(NOW)
    monkeypatch.setattr(roster, 'time', SimpleNamespace(
        time_ns=now.__next__, monotonic=time.monotonic))
    robots = Roster(True, RobotQuota())
    robots.admit('robot7')
    robots.reconnect('robot7')
    before = next(now)
    assert not robots.is_late('robot7', before)
    robots.disconnect('robot7')
    # What was still on its way at that moment was sent with a connection.
    assert not robots.is_late('robot7', before)
    sent = next(now)
    assert robots.is_late('robot7', sent)
    # A token that never comes, as of a robot that has none, makes no later message late.
    assert not robots.is_late('robot7', next(now))
    robots.reconnect('robot7')
    assert robots.is_late('robot7', sent)
    assert not robots.is_late('robot7', next(now))


def test_a_listener_that_was_there_before_its_router_hears_all(impatient, router, caplog):
    router.kill()
    with FleetListener(router.endpoint) as listener:
        until(lambda: caplog.records)
        router.start()
        with session_at(router.endpoint) as session, RobotPublisher(session, 'robot7') as robot:
            robot.send_static(message(('base', 'fork', 100)))
            assert x_of(listener.buffer, 'robot7/base', 'robot7/fork') == 100.0
    assert messages(caplog) == ['no connection', 'connected']


def test_what_a_bridge_keeps_comes_when_the_router_is_back(router):
    with session_at(router.endpoint) as session, FleetListener(router.endpoint) as listener:
        until(lambda: listener.connected)
        router.kill()
        publisher = kept(session, 'robot7/tf_static', message(('base', 'fork', 2)))
        until(lambda: not listener.connected)
        router.start()
        assert x_of(listener.buffer, 'robot7/base', 'robot7/fork') == 2.0
        publisher.undeclare()


def test_a_robot_that_comes_back_sends_its_statics_anew(router):
    visits = Visits()
    with FleetListener(router.endpoint, on_robot=visits) as listener:
        for fork in (1, 2):
            with session_at(router.endpoint) as session:
                # It dies without undeclaring anything: only its session ends.
                robot = RobotPublisher(session, 'robot7')
                robot.send_static(message(('base', 'fork', fork)))
                assert visits.wait() == ('robot7', True)
                until(lambda fork=fork: fork == x_of(
                    listener.buffer, 'robot7/base', 'robot7/fork'))
            assert visits.wait() == ('robot7', False)
