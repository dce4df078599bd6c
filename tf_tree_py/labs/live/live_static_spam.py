# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Spam over DDS: a calibration is sent 100 times a second, or once, to ten subscribers."""

from contextlib import ExitStack
from multiprocessing.connection import Connection
import time
from typing import NamedTuple

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf_tree_py.core import LATEST, TransformException
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster

from .live_session import answer, listening, lone_node, PATIENCE_S, session, ticks
from ..report import Column, Report, Table
from ..static_spam import CHILD, PARENT, POSE, RATE_HZ, SUBSCRIBERS

# The same edge under two names: one is sent continuously, the other once.
_SPAMMED, _STATIC = CHILD, f'{CHILD}_static'
_PROCESSES = 2
_SECONDS = 3.0


class Use(NamedTuple):
    """The CPU time of a process, and how many transforms it inserted."""

    cpu_s: float
    seconds: float
    transforms: int


def spam(node: Node, pipe: Connection) -> None:
    """Send the calibration at 100 Hz; on request stop, and report the CPU time."""
    broadcaster = TransformBroadcaster(node)
    begin, cpu, sent = time.monotonic(), time.process_time(), 0
    for _ in ticks(pipe, from_seconds(1.0 / RATE_HZ)):
        broadcaster.sendTransform(transform_stamped(PARENT, _SPAMMED, time.time_ns(), POSE))
        sent += 1
    pipe.recv()
    pipe.send(Use(time.process_time() - cpu, time.monotonic() - begin, sent))


def once(node: Node, pipe: Connection) -> None:
    """Send the calibration once, and stay until the end for late subscribers."""
    StaticTransformBroadcaster(node).sendTransform(
        transform_stamped(PARENT, _STATIC, LATEST, POSE))
    pipe.recv()


def subscribe(_: Node, pipe: Connection, number: int) -> None:
    """Run subscribers, each as if in its own process; wait for an edge and measure on request."""
    with ExitStack() as opened:
        nodes = [opened.enter_context(lone_node('subscriber')) for _ in range(number)]
        buffers = [opened.enter_context(listening(node)) for node in nodes]
        while True:
            pipe.send(_do(pipe.recv(), buffers))


def _do(order: str | float, buffers: list[Buffer]) -> str | Use:
    if isinstance(order, str):
        for buffer in buffers:
            buffer.lookup_within(PATIENCE_S, PARENT, order)
        return order
    begin, cpu, before = time.monotonic(), time.process_time(), _accepted(buffers)
    time.sleep(order)
    return Use(time.process_time() - cpu, time.monotonic() - begin, _accepted(buffers) - before)


def _accepted(buffers: list[Buffer]) -> int:
    return sum(buffer.statistics().accepted for buffer in buffers)


class Row(NamedTuple):
    """The cost a second of one way of sending: of all subscribers together, and of the sender."""

    how: str
    transforms: float
    payload: float
    subscribers_cpu: float
    sender_cpu: float


def run(seconds: float = _SECONDS) -> Report:
    """Measure the static edge, then the spam; then end the spammer."""
    size = len(serialize_message(TFMessage(transforms=[
        transform_stamped(PARENT, CHILD, time.time_ns(), POSE)])))
    with session() as lab, listening(lab.node('robot')) as buffer:
        pipes = [lab.start(subscribe, SUBSCRIBERS // _PROCESSES) for _ in range(_PROCESSES)]
        lab.start(once)
        quiet = _measure('once, static', pipes, _STATIC, seconds, size)
        spammer = lab.start(spam)
        loud = _measure(f'{RATE_HZ} Hz, as if it moved', pipes, _SPAMMED, seconds, size)
        # This buffer's listener may be the last to discover either sender.
        for child in (_STATIC, _SPAMMED):
            buffer.lookup_within(PATIENCE_S, PARENT, child)
        spammer.send('end')
        use = answer(spammer)
        loud = loud._replace(sender_cpu=use.cpu_s / use.seconds)
        after = _ask(buffer)
    return _report([loud, quiet], use.transforms / use.seconds, after, size)


def _measure(how: str, pipes: list[Connection], child: str, seconds: float, size: int) -> Row:
    """Wait until all subscribers have an edge, then measure their CPU time for a while."""
    for order in (child, seconds):
        for pipe in pipes:
            pipe.send(order)
        uses = [answer(pipe) for pipe in pipes]
    rate = sum(use.transforms / use.seconds for use in uses)
    return Row(how, rate, rate * size, sum(use.cpu_s / use.seconds for use in uses), 0.0)


def _ask(buffer: Buffer) -> list[tuple[str, str]]:
    """Look up for an image of this moment: the spammer has ended, the static sender may have."""
    results = []
    for how, child in ((f'{RATE_HZ} Hz, as if it moved', _SPAMMED), ('once, static', _STATIC)):
        try:
            buffer.lookup_transform(PARENT, child, Time(nanoseconds=time.time_ns()),
                                    Duration(nanoseconds=from_seconds(0.2)))
            results.append((how, 'answers'))
        except TransformException as error:
            results.append((how, f'{type(error).__name__}, after 0.2 s'))
    return results


def _report(rows: list[Row], sent: float, after: list[tuple[str, str]], size: int) -> Report:
    loud, quiet = rows
    return Report(
        tables=[
            Table(f'{SUBSCRIBERS} subscribers in {_PROCESSES} processes, a second of each',
                  (Column('how', 'the calibration is sent'),
                   Column('transforms', 'transforms received', '.0f'),
                   Column('payload_bytes', 'payload [kB]', '.1f'),
                   Column('subscribers_cpu', 'CPU, all subscribers [%]', '.1f'),
                   Column('sender_cpu', 'CPU, sender [%]', '.1f')), rows),
            Table("The spammer has ended; a lookup with an image's stamp, timeout 0.2 s",
                  (Column('how', 'the calibration was sent'), Column('lookup', 'lookup')), after)],
        law=f'{RATE_HZ} Hz to {SUBSCRIBERS} subscribers is {loud.payload / 1e3:.0f} kB/s of '
            f'payload ({size} bytes each) and '
            f'{(loud.subscribers_cpu + loud.sender_cpu) * 100.0:.0f} % of a core, for one pose '
            f'that never changes; when it is static, nothing is sent, and the processes idle at '
            f'{quiet.subscribers_cpu * 100.0:.1f} %.',
        numbers={'bytes_per_message': size, 'spam_sent_per_s': sent,
                 'spam_transforms_per_s': loud.transforms,
                 'static_transforms_per_s': quiet.transforms,
                 'spam_cpu': loud.subscribers_cpu + loud.sender_cpu,
                 'static_cpu': quiet.subscribers_cpu,
                 'after': dict(after)})
