# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Remounting over DDS: one edge is sent again, and the answers of all running modules change."""

from collections.abc import Sequence
from math import degrees, dist
from multiprocessing.connection import Connection, wait
import time
from typing import NamedTuple

from rclpy.node import Node
from tf_tree_py.core import LATEST, Pose, TransformException
from tf_tree_py.core.geometry.se3 import distance
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.ros.buffer.buffer import Buffer
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster, TransformBroadcaster
from tf_tree_py.ros.topics.listener import TransformListener

from .session import answers, session, ticks
from ..remount import Module, MODULES, moving, REMOUNT, REMOUNTED, SENSORS
from ..report import Column, Report, Table

_PERIOD = from_seconds(0.020)
_PROCESSES = 3
# How long to check that the modules without the camera report no change.
_AFTERWARDS_S = 0.3


class Answer(NamedTuple):
    """A module's report: the pose of its sensor, and when, nanoseconds."""

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


def perceive(node: Node, pipe: Connection, modules: Sequence[Module]) -> None:
    """Run some modules: look up their sensors 50 times a second, and report changes."""
    buffer = Buffer()
    told: dict[Module, Pose] = {}
    with TransformListener(buffer, node):
        for _ in ticks(pipe, _PERIOD):
            for module in modules:
                try:
                    pose = buffer.lookup(module.target, module.sensor, LATEST)
                except TransformException:
                    continue  # it has not come yet
                if told.get(module) != pose:
                    told[module] = pose
                    pipe.send(Answer(module.name, pose, time.time_ns()))


def run(processes: int = _PROCESSES) -> Report:
    """Start the robot and its modules, and remount the camera while they run."""
    with session() as lab:
        robot = lab.start(publish)
        pipes = [lab.start(perceive, MODULES[number::processes]) for number in range(processes)]
        before: dict[str, Answer] = {}
        while len(before) < len(MODULES):
            before.update((said.module, said) for said in answers(pipes))
        resent = time.time_ns()
        robot.send('remount')
        after = changes(pipes)
    return _report(before, after, resent, processes)


def changes(pipes: Sequence[Connection]) -> dict[str, Answer]:
    """Return the changes that modules report, until there are none for a while."""
    after = {said.module: said for said in answers(pipes)}
    while wait(pipes, _AFTERWARDS_S):
        after.update((said.module, said) for said in answers(pipes))
    return after


def table(title: str, before: dict[str, Answer], after: dict[str, Answer], since: int) -> Table:
    """
    Return what each module answered otherwise, and when.

    :param since: when somebody changed the tree, nanoseconds.
    """
    rows = []
    for module in MODULES:
        old = before[module.name].pose
        said = after.get(module.name)
        new = old if said is None else said.pose
        sensor_p = (module.ahead, 0.0, 0.0)
        rows.append((
            module.name, module.target, module.sensor,
            None if said is None else (said.when - since) / 1e9,
            dist(old @ sensor_p, new @ sensor_p),
            distance(old, new)[1]))
    return Table(title, (
        Column('module', 'module'), Column('target', 'target'), Column('sensor', 'sensor'),
        Column('after_s', 'new answer after [ms]', '.1f', 1e3),
        Column('moved_m', 'by [cm]', '.1f', 100.0),
        Column('turned_rad', 'by [deg]', '.1f', degrees(1.0))), rows)


def _report(before: dict[str, Answer], after: dict[str, Answer], resent: int,
            processes: int) -> Report:
    slowest = max((said.when - resent) / 1e9 for said in after.values())
    return Report(
        tables=[table(
            f'{len(MODULES)} modules in {processes} processes; one process sends '
            f'{REMOUNTED[0]} -> {REMOUNTED[1]} anew', before, after, resent)],
        law=f'one edge sent once changed the answers of all {len(after)} modules that see through '
            f'the camera within {slowest * 1e3:.0f} ms, and of no other, with no line of theirs '
            'touched and none restarted.',
        remarks=[f'A module asks for each of its frames, every {_PERIOD / 1e6:.0f} ms, so that is '
                 'part of the time.'],
        numbers={'changed': len(after), 'unchanged': len(MODULES) - len(after),
                 'slowest_s': slowest})
