# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Robots with a bridge or rmw_zenoh, whose data is as in the documents of these programs."""

import threading
import time

from conditions import until
from fleet_helpers import kept, message, rmw_token, Visits, x_of
from hypothesis import given, strategies as st
import pytest
from tf_tree_py.fleet import FleetListener
from tf_tree_py.fleet.keys import key_of, rmw_key_of, Topic, TYPE_HASH
from tf_tree_py.fleet.reception import read_attachment, Sending
from zenoh import ext


def serialized(sending):
    """Return the attachment that rmw_zenoh adds to a message."""
    fields = (('sequence_number', ext.Int64(sending.number)),
              ('source_timestamp', ext.Int64(sending.sent)),
              ('source_gid', bytes.fromhex(sending.sender[0])))
    return b''.join(ext.z_serialize(part).to_bytes() for field in fields for part in field)


def token_of(session, hall, topic):
    return rmw_token(session.zid(), f'{hall}%robot7', topic)


def test_a_bridge_is_understood_and_its_robot_appears_with_its_data(listen, session, hall):
    visits = Visits()
    listener = listen(on_robot=visits)
    until(lambda: listener.connected)
    for static in (True, False):
        edge = ('base', 'fork', 2) if static else ('map', 'base', 1)
        until(lambda static=static, edge=edge: session.put(
            key_of(Topic('robot7', static), hall), message(edge)) or any(
                info.static == static for info in listener.buffer.edges()))
    assert x_of(listener.buffer, 'map', 'robot7/fork') == 3.0
    assert visits.wait() == ('robot7', True)
    assert listener.robots()[0].here


def test_a_bridges_robot_goes_with_its_tokens(listen, session, hall):
    visits = Visits()
    listen(on_robot=visits)
    token = session.liveliness().declare_token(
        f'@/{session.zid()}/@ros2_lv/MP/{hall}§robot7§tf/tf2_msgs§msg§TFMessage/:::')
    assert visits.wait() == ('robot7', True)
    token.undeclare()
    assert visits.wait() == ('robot7', False)


def test_rmw_zenoh_is_understood(listen, session, hall):
    visits = Visits()
    listener = listen(on_robot=visits)
    token = session.liveliness().declare_token(token_of(session, hall, 'tf'))
    assert visits.wait() == ('robot7', True)
    moving = rmw_key_of(Topic('robot7', False), 0, key_prefix=hall)
    until(lambda: session.put(moving, message(('map', 'base', 5))) or listener.buffer.frames())
    assert x_of(listener.buffer, 'map', 'robot7/base') == 5.0
    token.undeclare()
    assert visits.wait() == ('robot7', False)


def test_robots_without_a_namespace_are_called_by_their_domain(router, session):
    with FleetListener(router, 'domain*') as listener:
        key = rmw_key_of(Topic('', False), 73)
        until(lambda: session.put(key, message(('map', 'base', 5))) or listener.buffer.frames())
        assert x_of(listener.buffer, 'map', 'domain73/base') == 5.0


@pytest.mark.parametrize('form', [key_of, rmw_key_of])
def test_what_is_static_is_there_for_whoever_comes_late(listen, session, hall, form):
    key = form(Topic('robot7', True), key_prefix=hall)
    publisher = kept(session, key, message(('base', 'fork', 2)))
    assert x_of(listen().buffer, 'robot7/base', 'robot7/fork') == 2.0
    publisher.undeclare()


def test_what_an_older_rmw_zenoh_has_kept_is_asked_for(listen, session, hall):
    key = rmw_key_of(Topic('robot7', True), key_prefix=hall)

    def answer(query):
        query.reply(key, message(('base', 'fork', 2)))

    cache = session.declare_queryable(f'{session.zid()}/{key}', answer, complete=True)
    token = session.liveliness().declare_token(token_of(session, hall, 'tf_static'))
    assert x_of(listen().buffer, 'robot7/base', 'robot7/fork') == 2.0
    token.undeclare()
    cache.undeclare()


def test_many_tokens_of_publishers_that_never_answer_cost_one_thread(
        listen, session, hall, caplog):
    asked = []  # A stored query without a response keeps the querying side waiting.
    cache = session.declare_queryable(f'{session.zid()}/**', asked.append, complete=True)
    tokens = [session.liveliness().declare_token(
        token_of(session, hall, 'tf_static').replace('/10/', f'/{number}/').replace(
            TYPE_HASH, f'RIHS01_{number}')) for number in range(60)]
    listener = listen()
    until(lambda: asked)
    # Three for tokens (one per form), four for keys (two by two kinds), and one each for the link,
    # the decoder, the answers, and the listener.
    assert sum(thread.name.startswith('fleet') for thread in threading.enumerate()) <= 11
    listener.close()
    assert not any(record.exc_info for record in caplog.records)
    asked.clear()
    for token in tokens:
        token.undeclare()
    cache.undeclare()


def test_answer_under_the_key_of_another_robot_is_not_taken(listen, session, hall):
    own, other = (rmw_key_of(Topic(robot, True), key_prefix=hall) for robot in (
        'robot7', 'robot8'))

    def answer(query):
        query.reply(other, message(('base', 'fork', 666)))
        query.reply(own, message(('base', 'fork', 2)))

    cache = session.declare_queryable(f'{session.zid()}/{own}', answer, complete=True)
    token = session.liveliness().declare_token(token_of(session, hall, 'tf_static'))
    buffer = listen().buffer
    assert x_of(buffer, 'robot7/base', 'robot7/fork') == 2.0
    assert not any(frame.startswith('robot8') for frame in buffer.frames())
    token.undeclare()
    cache.undeclare()


def test_bridge_without_a_namespace_is_told_of_once(listen, session, hall, caplog):
    listener = listen()
    tokens = [session.liveliness().declare_token(
        f'@/{session.zid()}/@ros2_lv/MP/{hall}§{topic}/tf2_msgs§msg§TFMessage/:::')
        for topic in ('tf', 'tf_static')]
    named = session.liveliness().declare_token(
        f'@/{session.zid()}/@ros2_lv/MP/{hall}§robot7§tf/tf2_msgs§msg§TFMessage/:::')
    until(lambda: listener.robots() and '--namespace' in caplog.text)
    assert caplog.text.count('start it with --namespace /robot7') == 1
    assert f"'{hall}/tf'" in caplog.text
    for token in (*tokens, named):
        token.undeclare()


def test_losses_show_in_the_numbers_that_rmw_zenoh_attaches(listen, session, hall):
    listener = listen()
    key = rmw_key_of(Topic('robot7', False), key_prefix=hall)
    until(lambda: session.put(key, message(('map', 'base', 0))) or listener.robots())
    for gid in ('07' * 16, '08' * 16):
        for number in (5, 6, 9, 10, 20):
            session.put(key, message(('map', 'base', number)), attachment=serialized(
                Sending(time.time_ns(), (gid, 0), number)))
    until(lambda: listener.robots()[0].lost == 2 * (2 + 9))


@given(st.binary(max_size=100) | st.binary(min_size=77, max_size=77))
def test_another_attachment_is_none(data):
    assert read_attachment(data) is None


def test_an_attachment_is_read_as_zenoh_serializes_it():
    sending = Sending(1_700_000_000_000_000_000, (bytes(range(16)).hex(), 0), 5)
    assert read_attachment(serialized(sending)) == sending
