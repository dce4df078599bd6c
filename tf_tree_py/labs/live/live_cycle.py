# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The loop over DDS: two processes each publish the other's frame as a child."""

from collections import Counter
from collections.abc import Sequence
from itertools import permutations
from multiprocessing.connection import Connection
import threading
import time

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster

from .live_session import listening, PATIENCE_S, session, ticks
from ..cycle import BASE_T_ODOM, BELOW, FRAMES, ODOM_T_BASE
from ..report import Column, Report, Table

_PERIOD = from_seconds(0.020)
# The names of publishers are looked up in the graph, once a second.
_WATCHED_S = 1.5


class Refusals(Observer):
    """Notes what a buffer refuses, and when."""

    def __init__(self) -> None:
        self.refused: list[tuple[int, Incident]] = []
        self.has_refused = threading.Event()

    def saw_incidents(self, incidents: Sequence[Incident]) -> None:
        """Note it."""
        for incident in incidents:
            if incident.refused:
                self.refused.append((time.time_ns(), incident))
                self.has_refused.set()


def ekf(node: Node, pipe: Connection) -> None:
    """Publish odom -> base_link, and once the edges below it."""
    StaticTransformBroadcaster(node).sendTransform(
        [transform_stamped(parent, child, time.time_ns(), pose)
         for child, (parent, pose) in BELOW.items()])
    _publish(node, pipe, 'odom', 'base_link', ODOM_T_BASE)


def wheel_odometry(node: Node, pipe: Connection) -> None:
    """Publish base_link -> odom."""
    _publish(node, pipe, 'base_link', 'odom', BASE_T_ODOM)


def _publish(node: Node, pipe: Connection, parent: str, child: str, pose: Pose) -> None:
    broadcaster = TransformBroadcaster(node)
    for _ in ticks(pipe, _PERIOD):
        broadcaster.sendTransform(transform_stamped(parent, child, time.time_ns(), pose))


def run(seconds: float = _WATCHED_S) -> Report:
    """Start the first publisher, then the second, and look up continuously."""
    answers: Counter[str] = Counter()
    with session() as lab:
        refusals = Refusals()
        with listening(lab.node('robot'), [refusals]) as buffer:
            lab.start(ekf)
            buffer.lookup_transform('odom', 'camera', Time(), Duration(seconds=int(PATIENCE_S)))
            lab.start(wheel_odometry)
            if not refusals.has_refused.wait(PATIENCE_S):
                raise RuntimeError('nothing was received from the second node')
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                answers.update(_ask(buffer))
                time.sleep(_PERIOD / 1e9)
            taken = buffer.statistics().accepted
    return _report(refusals.refused, answers, taken, seconds)


def _ask(buffer: Buffer) -> list[str]:
    """Look up every pair of frames; return the result of each."""
    results = []
    for target, source in permutations(FRAMES, 2):
        try:
            x = buffer.lookup(target, source, LATEST).x
            results.append(f'{target} <- {source}: x = {x:.2f} m')
        except TransformException as error:
            results.append(f'{target} <- {source}: {type(error).__name__}')
    return results


def _report(refused: list[tuple[int, Incident]], answers: Counter[str], taken: int,
            seconds: float) -> Report:
    (heard, first), (_, last) = refused[0], refused[-1]
    late = (heard - first.stamp) / 1e9
    errors = sum(count for result, count in answers.items() if result.endswith('Exception'))
    return Report(
        tables=[Table(
            f'{seconds:g} s with both nodes up',
            (Column('taken', 'transforms taken'), Column('refused', 'refused'),
             Column('lookups', 'lookups'), Column('pairs', 'pairs'),
             Column('answers', 'different answers'), Column('errors', 'errors')),
            [(taken, len(refused), answers.total(), len(FRAMES) * (len(FRAMES) - 1),
              len(answers), errors)])],
        law=f'the first edge that closes the loop is refused {late * 1e3:.1f} ms after its stamp, '
            'when it arrives, and so is every one after it; every pair keeps one answer.',
        remarks=[f'The warning about the last one:\n{last}',
                 'A message does not name its sender: with two publishers on /tf the warning '
                 'names "one of" the two.'],
        numbers={'refused_after_s': late, 'refused': len(refused), 'errors': errors,
                 'different_answers': len(answers), 'incident': str(last)})
