# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The arm's process: the simulation in real time, without ROS.

It sends the positions of its joints, images of its camera, and the results of runs; it receives
poses of the block. Its first argument is its end of the pipe.
"""

from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from multiprocessing.connection import Connection
import sys
import time
import xml.etree.ElementTree as ET

import pybullet_data
from tf_tree_py.core import from_seconds, Pose

from .wire import Grasp, Hello, Picture, State
from ..cell import BASE, BEGIN, Cell, HAND, HAND_T_CAMERA
from ..pick_and_place import LOOKED, LOOKING_SPEED, LOOKOUT, NothingFound
from ..rendering import INTRINSICS
from ..report import Trial
from ..trial import judged, scene_of

_IMAGE_PERIOD = from_seconds(0.1)
_MOST_TURNS = 3


def description() -> str:
    """Return the URDF of the arm on its table, with the camera on its hand."""
    robot = ET.parse(f'{pybullet_data.getDataPath()}/franka_panda/panda.urdf').getroot()
    _add_link(robot, 'camera', HAND, HAND_T_CAMERA)
    # The world frame is the parent of the base, so it is added last.
    ET.SubElement(robot, 'link', name='world')
    _add_joint(robot, 'world', BASE, Pose())
    return ET.tostring(robot, encoding='unicode')


def _add_link(robot: ET.Element, name: str, parent: str, parent_T_link: Pose) -> None:
    ET.SubElement(robot, 'link', name=name)
    _add_joint(robot, parent, name, parent_T_link)


def _add_joint(robot: ET.Element, parent: str, child: str, parent_T_child: Pose) -> None:
    joint = ET.SubElement(robot, 'joint', name=f'{child}_mount', type='fixed')
    ET.SubElement(joint, 'parent', link=parent)
    ET.SubElement(joint, 'child', link=child)
    ET.SubElement(joint, 'origin', xyz=_numbers(parent_T_child.translation),
                  rpy=_numbers(parent_T_child.as_rpy()))


def _numbers(values: Sequence[float]) -> str:
    return ' '.join(map(repr, values))


def look(cell: Cell, pipe: Connection) -> Pose:
    """
    Turn, and send images, until the pose of the block arrives; return world_T_block.

    It turns back and forth a few times, because on a busy machine the processes connect, and
    images are evaluated, later than the first turn ends.
    """
    begin = cell.stamp
    for goal in (LOOKED, LOOKOUT) * _MOST_TURNS:
        for _ in cell.moving_to(goal, LOOKING_SPEED):
            if cell.stamp % _IMAGE_PERIOD == 0:
                pipe.send(Picture.of(cell.take_image()))
            while pipe.poll():
                grasp: Grasp = pipe.recv()
                if grasp.stamp > begin:  # not the detection of the last run
                    return grasp.world_T_block
    raise NothingFound('no image shows the block')


def play(number: int, seed: int, begin: int, pipe: Connection) -> int:
    """Do one run; return the stamp at its end."""
    with closing(Cell(scene_of(seed, number), LOOKOUT, begin=begin)) as cell:
        cell.watchers += [lambda: pipe.send(State(cell.stamp, cell.joint_states())),
                          in_real_time(cell)]
        try:
            pipe.send(judged(cell, look(cell, pipe), Trial(number)))
        except NothingFound as error:
            pipe.send(Trial(number, remark=str(error)))
        return cell.stamp


def in_real_time(cell: Cell) -> Callable[[], None]:
    """Return a function that delays the simulation to real time."""
    begin, started = cell.stamp, time.monotonic()

    def wait() -> None:
        ahead = (cell.stamp - begin) / 1e9 - (time.monotonic() - started)
        if ahead > 0.0:
            time.sleep(ahead)
    return wait


def main(pipe: Connection, runs: int, seed: int) -> None:
    """Do all runs, after the other end has reported that all processes are connected."""
    pipe.send(Hello(description(), INTRINSICS))
    pipe.recv()
    stamp = BEGIN
    for number in range(runs):
        stamp = play(number, seed, stamp, pipe)


if __name__ == '__main__':
    # The process at the other end may end.
    with suppress(BrokenPipeError, EOFError, ConnectionResetError):
        fd, runs, seed = map(int, sys.argv[1:])
        main(Connection(fd), runs, seed)
