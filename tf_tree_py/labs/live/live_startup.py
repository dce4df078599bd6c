# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Startup over DDS: a listener starts before the static publisher, 50 times."""

from multiprocessing.connection import Connection
import time

import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py.core import LATEST
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster

from .live_session import answer, listening, lone_node, session
from ..report import Report
from ..startup import CHILD, measure, PARENT, POSE, report, Start, STARTS


def publish(_: Node, pipe: Connection) -> None:
    """On each request start a publisher, and on the next one end it."""
    pipe.send('ready')
    while True:
        pipe.recv()
        with lone_node('static_publisher') as publisher:
            StaticTransformBroadcaster(publisher).sendTransform(
                transform_stamped(PARENT, CHILD, LATEST, POSE))
            pipe.send(time.monotonic())
            pipe.recv()
        pipe.send('ended')


def run(starts: int = STARTS) -> Report:
    """Start a listener, then the publisher, and look up; repeat."""
    with session() as lab:
        publisher = lab.start(publish)
        answer(publisher)
        measured = [_start(publisher) for _ in range(starts)]
    sent = np.median([sent for _, sent in measured]) * 1e3
    return report([one for one, _ in measured],
                  f'The transform was sent {sent:.1f} ms (median) after the listener started; the '
                  'rest is discovery.')


def _start(publisher: Connection) -> tuple[dict[float, Start], float]:
    """Return the programs' results, and after how many seconds the transform was sent."""
    with lone_node('early_listener') as node:
        with listening(node) as buffer:
            begin = time.monotonic()
            one = measure(lambda timeout: buffer.lookup_transform(
                PARENT, CHILD, Time(), Duration(nanoseconds=from_seconds(timeout))),
                lambda: publisher.send('start'))
            # All processes of a machine share this clock.
            sent = answer(publisher) - begin
        publisher.send('end')
        answer(publisher)
    return one, sent
