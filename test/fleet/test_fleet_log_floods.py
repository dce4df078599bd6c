# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A flood of varied garbage over Zenoh: a line a second for each kind and robot, and counts."""

from collections import Counter
import logging
import time

from conditions import until
from fleet_helpers import message, robot_of, send_first
from garbage import flows_of, garbage, omitted, told
from tf_tree_py.core import Kind
from tf_tree_py.fleet import RobotQuota

INCIDENTS = 'tf_tree_py.fleet.incidents'
UNLIMITED = RobotQuota(1e9, 1e12, 10**6, 10**12, 10**9, 1e9)

OTHERS = 'others than the 10 senders named'


def lines(caplog, name):
    return [record.getMessage() for record in caplog.records if record.name == name]


def incidents(buffer):
    return Counter({kind: count for kind, count in buffer.statistics().incidents.items() if count})


def settle(listener, robot, number):
    """Wait until all that a robot has sent was taken, or dropped by Zenoh on a busy machine."""
    def is_here():
        robot.send(message(('map', 'base', number)))
        return listener.buffer.lookup('map', f'{robot.robot}/base').x == number

    until(is_here)


def test_flood_of_one_robot(listen, robot, caplog):
    listener, evil, sent = listen(quota=UNLIMITED), robot('evil'), 3000
    begin, now = time.monotonic(), int(time.time())
    send_first(listener, evil, message(('map', 'base', 1)))
    for number in range(sent):
        evil.send(garbage(number, now))
        if number % 50 == 49:
            settle(listener, evil, number)
    counts = incidents(listener.buffer)
    assert sum(counts.values()) > sent * 0.5 and len(counts) >= 8
    until(lambda: told(lines(caplog, INCIDENTS)) == sum(counts.values()))
    elapsed_s = time.monotonic() - begin
    flows = flows_of(lines(caplog, INCIDENTS))
    assert flows.keys() == {(kind.value, 'evil') for kind in counts}
    for (kind, _), of_flow in flows.items():
        assert len(of_flow) <= elapsed_s + 1.0, kind
        assert told(of_flow) == counts[Kind(kind)]


def test_flood_of_robots_that_nobody_has(listen, robot, session, hall, caplog, clock):
    listener, first = listen(quota=UNLIMITED), robot('first')
    send_first(listener, first, message(('map', 'base', 1)))
    for number in range(300):
        session.put(f'{hall}/robot{number}/tf', message(('trap', 'map', 1)))
        if number % 50 == 49:
            settle(listener, first, number)
    # All that will arrive has arrived, and each robot has its own queue.
    until(lambda: all(one.refused for one in listener.robots() if one.name != 'first'))
    count = incidents(listener.buffer)[Kind.NOT_ITS_OWN]
    assert count > 150, 'Zenoh may drop some'
    assert len(lines(caplog, INCIDENTS)) == 11, 'ten robots, and all others together'
    clock.now += 1.0
    until(lambda: told(lines(caplog, INCIDENTS)) == count)
    # Of the ten, none has sent more than one message.
    assert len(lines(caplog, INCIDENTS)) == 12
    assert OTHERS in lines(caplog, INCIDENTS)[-1]


def logs_of(listener):
    return listener._logs


def test_robots_that_are_ignored(listen, robot, session, hall, caplog, clock):
    listener, first = listen('**'), robot('robot7')
    send_first(listener, first, message(('map', 'base', 1)))
    for number in range(200):
        session.put(f'{hall}/robot7/arm{number}/tf', message(('map', 'base', 1)))
    settle(listener, first, 2)
    count = 11 + omitted(logs_of(listener).warnings)
    assert count > 50
    assert len(lines(caplog, 'tf_tree_py.fleet')) == 11
    assert all('is ignored' in line for line in lines(caplog, 'tf_tree_py.fleet'))
    clock.now += 1.0
    until(lambda: told(lines(caplog, 'tf_tree_py.fleet')) == count)


def test_messages_beyond_a_quota_are_counted_in_the_log_too(listen, robot, caplog, clock):
    listener, evil = listen(quota=RobotQuota(messages_per_s=1e-6)), robot('evil')
    send = message(('map', 'base', 1))
    until(lambda: evil.send(send) or robot_of(listener, 'evil')
          and robot_of(listener, 'evil').dropped)
    for _ in range(200):
        evil.send(send)
    until(lambda: robot_of(listener, 'evil').dropped > 100)
    (line,) = lines(caplog, 'tf_tree_py.fleet')
    assert "'evil' are dropped" in line and 'messages_per_s' in line

    def all_are_told():
        clock.now += 1.0
        return told(lines(caplog, 'tf_tree_py.fleet')) == robot_of(listener, 'evil').dropped

    until(all_are_told)
    assert len(lines(caplog, 'tf_tree_py.fleet')) <= clock.now - 1000.0 + 1.0


def test_callback_that_raises_for_each_robot(listen, session, hall, caplog, clock):
    def refuse(robot, here):
        raise ValueError(f'cannot take {robot}')

    listener, robots = listen(on_robot=refuse, quota=UNLIMITED), 100
    for number in range(robots):
        until(lambda number=number: session.put(
            f'{hall}/robot{number}/tf', message(('map', 'base', 1))) or robot_of(
                listener, f'robot{number}'))
    until(lambda: omitted(logs_of(listener).failures) == robots - 11)
    records = [one for one in caplog.records if one.name == 'tf_tree_py.fleet']
    assert len(records) == 11 and {one.levelno for one in records} == {logging.ERROR}
    assert 'ValueError: cannot take robot0' in records[0].getMessage()
    clock.now += 1.0
    until(lambda: told(lines(caplog, 'tf_tree_py.fleet')) == robots)
