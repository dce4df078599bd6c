# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The current rates of edges, and the edges with problems."""

import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.doctor import Doctor, Monitor

SECOND = 10**9


class Robot:
    """Sends two edges into a buffer that a doctor observes."""

    def __init__(self):
        self.doctor, self.buffer = Doctor(), BufferCore()
        self.buffer.observers.add(self.doctor)
        self.monitor = Monitor(self.doctor)

    def send(self, child, begin, end, rate_hz, static=False):
        edges = [('map', child)]
        for number in range(round((end - begin) * rate_hz)):
            stamp = round((begin + number / rate_hz) * SECOND)
            batch = Batch(edges, [stamp], [pack_pose(*Pose(x=stamp / 1e9))])
            self.buffer.observers.notify_received(
                ReceivedMessage(batch, stamp + 3_000_000, '/tf', static, '/wheels'))
            self.buffer.insert_batch(batch, '/wheels', static, announced=True)

    def rates(self, now):
        return {row.signs.child: row.rate_hz
                for row in self.monitor.look(now, self.doctor.findings(), 0)}


def test_rates_are_those_of_the_last_seconds():
    robot = Robot()
    robot.send('a', 1, 9, 10)
    assert robot.rates(8.0) == {'a': pytest.approx(10.0)}
    for now in range(9, 20):
        robot.send('a', now, now + 1, 50)
        rates = robot.rates(float(now))
    assert rates == {'a': pytest.approx(50.0)}


def test_edge_that_ended_has_no_rate_and_is_silent():
    robot = Robot()
    robot.send('c', 0, 1, 1, static=True)
    robot.send('b', 1, 2, 10)
    robot.send('a', 1, 5, 10)
    robot.send('b', 2, 9, 10)
    assert robot.rates(0.0) == {'a': 0.0, 'b': pytest.approx(10.0), 'c': 0.0}
    a, b, c = robot.monitor.look(0.0, robot.doctor.findings(), 0)
    assert (a.signs.child, a.severity.value, a.signs.silence) == ('a', 'warning', 4 * SECOND)
    assert (a.signs.delay_p50, a.signs.delay_p95, a.signs.longest_gap) == (
        3_000_000, 3_000_000, SECOND // 10)
    assert (b.signs.child, b.severity, b.signs.publishers) == ('b', None, ('/wheels',))
    assert (c.signs.static, c.signs.silence, c.signs.delay_p50) == (True, None, None)
    assert a.as_dict().keys() == c.as_dict().keys()


def test_slow_edge_keeps_its_rate_between_two_samples():
    robot = Robot()
    robot.send('slow', 1, 21, 0.5)
    for now in range(3):
        assert robot.rates(float(now)) == {'slow': pytest.approx(0.5)}
