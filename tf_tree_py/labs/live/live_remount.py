# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Remounting over DDS: one edge is sent again, and the answers of running modules change."""

from collections.abc import Sequence
from math import dist
from multiprocessing.connection import Connection, wait
import time
from typing import NamedTuple

from rclpy.node import Node
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.geometry.se3 import distance
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster

from .live_session import answers, listening, Session, session, ticks
from ..remount import Module, MODULES, moving, REMOUNT, REMOUNTED, SENSORS
from ..report import Column, Report, Table

_PERIOD = from_seconds(0.020)
_PROCESSES = 3
# How long to check that the modules without the camera report no change.
_AFTERWARDS_S = 0.3


class Answer(NamedTuple):
    """A module's report: the pose of its sensor, and the time, nanoseconds."""

    module: str
    pose: Pose
    when: int


def publish(node: Node, pipe: Connection) -> None:
    """Publish as the robot: 32 moving edges at 50 Hz, and 6 static; remount one on request."""
    broadcaster, fixed = TransformBroadcaster(node), StaticTransformBroadcaster(node)
    fixed.sendTransform([transform_stamped(parent, child, time.time_ns(), pose)
                         for (parent, child), pose in SENSORS.items()])
    edges = moving()
    while True:
        for _ in ticks(pipe, _PERIOD):
            stamp = time.time_ns()
            broadcaster.sendTransform([transform_stamped(parent, child, stamp, pose)
                                       for (parent, child), pose in edges.items()])
        pipe.recv()
        fixed.sendTransform(transform_stamped(*REMOUNTED, time.time_ns(), REMOUNT))


def _perceive(node: Node, pipe: Connection, modules: Sequence[Module]) -> None:
    """Run some modules: look up their sensors 50 times a second, and report changes."""
    reported: dict[Module, Pose] = {}
    with listening(node) as buffer:
        for _ in ticks(pipe, _PERIOD):
            for module in modules:
                try:
                    pose = buffer.lookup(module.target, module.sensor, LATEST)
                except TransformException:
                    continue  # it has not arrived yet
                if reported.get(module) != pose:
                    reported[module] = pose
                    pipe.send(Answer(module.name, pose, time.time_ns()))


def run(processes: int = _PROCESSES) -> Report:
    """Start the robot and its modules, and remount the camera while they run."""
    with session() as lab:
        robot = lab.start(publish)
        pipes, before = start_modules(lab, processes)
        resent = time.time_ns()
        robot.send('remount')
        after = changes(pipes)
    return _report(before, after, resent, processes)


def start_modules(lab: Session, processes: int) -> tuple[list[Connection], dict[str, Answer]]:
    """Start processes with all modules; return them, and the first answer of each module."""
    pipes = [lab.start(_perceive, MODULES[number::processes]) for number in range(processes)]
    first: dict[str, Answer] = {}
    while len(first) < len(MODULES):
        first.update((found.module, found) for found in answers(pipes))
    return pipes, first


def changes(pipes: Sequence[Connection]) -> dict[str, Answer]:
    """Return the changes that modules report, until there are none for a while."""
    after = {found.module: found for found in answers(pipes)}
    while wait(pipes, _AFTERWARDS_S):
        after.update((found.module, found) for found in answers(pipes))
    return after


def table(title: str, before: dict[str, Answer], after: dict[str, Answer], since: int) -> Table:
    """
    Return the changes of the modules' answers, and their times.

    :param since: the time of the change of the tree, nanoseconds.
    """
    rows = []
    for module in MODULES:
        old = before[module.name].pose
        found = after.get(module.name)
        new = old if found is None else found.pose
        sensor_p = (module.ahead, 0.0, 0.0)
        rows.append((
            module.name, module.target, module.sensor,
            None if found is None else (found.when - since) / 1e9,
            dist(old @ sensor_p, new @ sensor_p),
            distance(old, new)[1]))
    return Table(title, (
        Column('module', 'module'), Column('target', 'target'), Column('sensor', 'sensor'),
        Column('after_s', 'new answer after [ms]', '.1f'), Column('moved_m', 'by [cm]', '.1f'),
        Column('turned_rad', 'by [deg]', '.1f')), rows)


def _report(before: dict[str, Answer], after: dict[str, Answer], resent: int,
            processes: int) -> Report:
    slowest = max((found.when - resent) / 1e9 for found in after.values())
    return Report(
        tables=[table(
            f'{len(MODULES)} modules in {processes} processes; one process sends '
            f'{REMOUNTED[0]} -> {REMOUNTED[1]} again', before, after, resent)],
        law=f'one edge sent once changed the answers of the {len(after)} modules that use '
            f'the camera within {slowest * 1e3:.0f} ms, and of no other module; none of them was '
            'edited or restarted.',
        remarks=[f'A module looks up its frames every {_PERIOD / 1e6:.0f} ms, which is '
                 'part of that time.'],
        numbers={'changed': len(after), 'unchanged': len(MODULES) - len(after),
                 'slowest_s': slowest})
