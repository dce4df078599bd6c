# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A hostile publisher on /tf: ``python -m benchmark.processes.hostile_publisher ATTACK ROOT LEAF``.

ATTACK is one of ``ATTACKS``; ROOT and LEAF are the first and the last frame of an honest chain.
"""

from collections.abc import Callable, Iterator
import itertools
import sys
import time

import rclpy
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from tf_tree_py.core import Sample
from tf_tree_py.core.geometry.se3 import IDENTITY
from tf_tree_py.core.messages.wire import write
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from ..worker import serve

_YEAR = 365 * 86_400 * 10**9
_HUGE, _CROWD = 64 * 1024, 10_000


def tangles(root: str, leaf: str) -> Iterator[list[Sample]]:
    """Hang the honest root below the honest leaf, make loops, and re-hang frames all the time."""
    for number in itertools.count():
        now = time.time_ns()
        yield [Sample(leaf, root, now, IDENTITY),
               Sample(f'loop_{number % 3}', f'loop_{(number + 1) % 3}', now, IDENTITY),
               Sample(f'parent_{number % 50}', 'hung', now, IDENTITY)]


def names(root: str, leaf: str) -> Iterator[list[Sample]]:
    """Send names of 64 kB, and other names that are none."""
    for number in itertools.count():
        now = time.time_ns()
        yield [Sample(f'{number}'.zfill(_HUGE), f'child_{number % 7}', now, IDENTITY),
               Sample(root, f'\x1b[2J\n{number % 11}', now, IDENTITY),
               Sample(root, '', now, IDENTITY)]


def crowds(root: str, leaf: str) -> Iterator[list[Sample]]:
    """Send 10,000 new frames in each message."""
    for number in itertools.count():
        now = time.time_ns()
        yield [Sample(root, f'crowd_{number}_{child}', now, IDENTITY) for child in range(_CROWD)]


def stamps(root: str, leaf: str) -> Iterator[list[Sample]]:
    """Send an honest edge and another one with stamps that are years away."""
    for number in itertools.count():
        now = time.time_ns()
        years = (number % 31 - 20) * _YEAR
        yield [Sample(root, 'frame_1', now + 10 * _YEAR, IDENTITY),
               Sample(root, 'wanders', now + years, IDENTITY)]


ATTACKS: dict[str, tuple[Callable[[str, str], Iterator[list[Sample]]], float]] = {
    'tangles': (tangles, 500.0), 'names': (names, 100.0), 'crowds': (crowds, 2.0),
    'stamps': (stamps, 500.0)}
"""Each attack, and its rate in Hz."""


def attack(name: str, root: str, leaf: str, seconds: float) -> int:
    """Attack for a time; return the number of messages sent."""
    node = Node(f'hostile_{name}')
    publisher = node.create_publisher(TFMessage, TF_TOPIC, dynamic_qos())
    messages, rate_hz = ATTACKS[name]
    begin = time.monotonic()
    for number, samples in enumerate(messages(root, leaf)):
        due = begin + number / rate_hz
        if due > begin + seconds:
            return number
        time.sleep(max(0.0, due - time.monotonic()))
        publisher.publish(write(samples))
    return 0


if __name__ == '__main__':
    rclpy.init()
    kind, upper, lower = sys.argv[1:4]
    serve({'attack': lambda seconds: attack(kind, upper, lower, seconds)})
    rclpy.try_shutdown()
