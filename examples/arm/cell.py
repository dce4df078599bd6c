# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The simulated cell: a table, an arm, blocks and a tray in PyBullet, and a camera on the wrist.

It represents the real world. A program receives what a robot receives: the time, its joints
and links, and images. Only the evaluation uses the true pose of the block.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import pybullet
from tf_tree_py.core import from_seconds, Pose

from .furniture import furnish
from .image import Image, Intrinsics
from .motion import Joints, trapezoid
from .rendering import INTRINSICS, render
from .scene import BLOCK_SIZE, Scene
from .simulator import Simulator

STEP = from_seconds(0.004)
"""From one step of the simulation to the next, nanoseconds."""

BEGIN = from_seconds(1.0)
"""The first stamp; a stamp of zero would mean the latest."""

HAND_T_CAMERA = Pose.from_xyz_rpy(x=0.08, z=0.02, yaw=np.pi / 2)
"""The mounting of the camera on the hand: it points along the fingers, past them."""

OPEN, CLOSED = 0.039, 0.0
"""The goal of each finger, as its distance from the middle, metres."""

BASE, HAND = 'panda_link0', 'panda_hand'
_ARM_JOINTS = range(7)
_EFFORTS = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)
_FINGERS = (9, 10)
_GRIP, _FINGER_SPEED = 30.0, 0.1


class Link(NamedTuple):
    """One link of the arm, and its parent link."""

    parent: str
    name: str
    moves: bool


class Cell:
    """
    The simulated world, advanced step by step.

    :param joints: the initial angles, radians.
    :param step: nanoseconds.
    :param begin: the first stamp.
    :ivar links: the arm's links, each after its parent.
    :ivar watchers: functions that are called after each step.
    """

    def __init__(self, scene: Scene, joints: Joints, step: int = STEP,
                 begin: int = BEGIN) -> None:
        self.stamp = begin
        self.watchers: list[Callable[[], None]] = []
        self._step = step
        self._bullet = Simulator()
        self._bullet.setTimeStep(step / 1e9)
        self._bullet.setGravity(0.0, 0.0, -9.81)
        self._bullet.setPhysicsEngineParameter(numSolverIterations=200)
        self._arm = self._bullet.load_arm()
        self.links = self._read_links()
        self._block = furnish(self._bullet, scene)
        for number, angle in zip(_ARM_JOINTS, joints, strict=True):
            self._bullet.resetJointState(self._arm, number, angle)
        for number in _FINGERS:
            self._bullet.resetJointState(self._arm, number, OPEN)
        self._couple_fingers()
        self.grip(OPEN)
        self._drive(joints)

    def close(self) -> None:
        """End the simulator."""
        self._bullet.close()

    # --- actions of the robot

    def step(self) -> None:
        """Simulate one step."""
        self._bullet.stepSimulation()
        self.stamp += self._step
        for watcher in self.watchers:
            watcher()

    def wait(self, seconds: float) -> None:
        """Simulate for a time."""
        for _ in range(from_seconds(seconds) // self._step):
            self.step()

    def moving_to(self, goal: Joints, speed: float) -> Iterator[None]:
        """
        Move the arm, one step for each iteration of the caller's loop.

        :param speed: the speed of the fastest joint, radians a second.
        """
        for joints in trapezoid(self.joints(), goal, speed, self._step / 1e9):
            self._drive(joints)
            self.step()
            yield

    def grip(self, width: float) -> None:
        """Set the target width of the fingers, which move during the following steps."""
        for finger in _FINGERS:
            self._bullet.setJointMotorControl2(
                self._arm, finger, pybullet.POSITION_CONTROL, targetPosition=width,
                force=_GRIP, maxVelocity=_FINGER_SPEED,
                positionGain=1.0, velocityGain=1.0)

    def _drive(self, joints: Joints) -> None:
        # With both gains at one, the motors choose the speeds that reach the target in one step.
        self._bullet.setJointMotorControlArray(
            self._arm, _ARM_JOINTS, pybullet.POSITION_CONTROL, targetPositions=list(joints),
            forces=_EFFORTS, positionGains=[1.0] * 7, velocityGains=[1.0] * 7)

    # --- measurements of the robot

    def joints(self) -> Joints:
        """Return the seven angles, radians."""
        return np.array([state[0] for state in
                         self._bullet.getJointStates(self._arm, _ARM_JOINTS)])

    def joint_states(self) -> dict[str, float]:
        """Return the positions of all moving joints, radians and metres."""
        numbers = [*_ARM_JOINTS, *_FINGERS]
        states = self._bullet.getJointStates(self._arm, numbers)
        return {self._bullet.getJointInfo(self._arm, number)[1].decode(): state[0]
                for number, state in zip(numbers, states, strict=True)}

    def link_poses(self) -> dict[str, Pose]:
        """Return world_T_link of every link."""
        states = self._bullet.getLinkStates(
            self._arm, range(len(self.links)), computeForwardKinematics=True)
        return {BASE: Pose()} | {
            link.name: Pose(*state[4], *state[5])
            for link, state in zip(self.links, states, strict=True)}

    def take_image(self) -> Image:
        """Return a current image of the camera on the wrist."""
        return self.take_image_from(self.link_poses()[HAND] @ HAND_T_CAMERA, INTRINSICS)

    # --- only for the evaluation

    def world_T_top(self) -> Pose:
        """Return the true pose of the middle of the block's top."""
        position, rotation = self._bullet.getBasePositionAndOrientation(self._block)
        return Pose(*position, *rotation) @ Pose(z=BLOCK_SIZE[2] / 2)

    def take_image_from(self, world_T_camera: Pose, intrinsics: Intrinsics) -> Image:
        """Return a current image of any camera."""
        return render(self._bullet, world_T_camera, intrinsics, self.stamp)

    # --- construction

    def _read_links(self) -> list[Link]:
        infos = [self._bullet.getJointInfo(self._arm, number)
                 for number in range(self._bullet.getNumJoints(self._arm))]
        names = [info[12].decode() for info in infos]
        return [Link(names[info[16]] if info[16] >= 0 else BASE, name,
                     info[2] != pybullet.JOINT_FIXED)
                for name, info in zip(names, infos, strict=True)]

    def _couple_fingers(self) -> None:
        """Couple the fingers like the real ones, because PyBullet ignores `mimic`."""
        gear = self._bullet.createConstraint(
            self._arm, _FINGERS[0], self._arm, _FINGERS[1], pybullet.JOINT_GEAR,
            jointAxis=(1, 0, 0), parentFramePosition=(0, 0, 0), childFramePosition=(0, 0, 0))
        self._bullet.changeConstraint(gear, gearRatio=-1.0, erp=0.1, maxForce=100.0)
