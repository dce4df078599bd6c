# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Inverse kinematics: the joints that bring the gripper to a pose."""

import numpy as np
from tf_tree_py.core import Pose

from .motion import Joints
from .simulator import Simulator

_GRASP_LINK = 11
_ROUNDS = 50
_CLOSE_M, _CLOSE_RAD = 0.0005, 0.005

REST = np.array([0.0, -0.33, 0.0, -2.28, 0.0, 1.95, np.pi / 4])
"""The joints with which the hand points down, half a metre before the arm."""


class OutOfReach(Exception):
    """The arm cannot reach the pose of the gripper."""


class Kinematics:
    """The arm alone, in a separate simulator, in which joints can be tried out."""

    def __init__(self) -> None:
        self._bullet = Simulator()
        self._arm = self._bullet.load_arm()
        infos = [self._bullet.getJointInfo(self._arm, number) for number in range(7)]
        self._lowest, self._highest = ([info[field] for info in infos] for field in (8, 9))

    def close(self) -> None:
        """End the simulator."""
        self._bullet.close()

    def joints_for(self, world_T_grasp: Pose) -> Joints:
        """
        Return the joints that bring the middle between the fingertips to a pose.

        Seven joints are one more than necessary; the solution is close to the arm's rest position.

        :raises OutOfReach: no solution was found.
        """
        joints = REST.copy()
        joints[0] = np.arctan2(world_T_grasp.y, world_T_grasp.x)
        for _ in range(_ROUNDS):
            self._put(joints)
            if self._is_at(world_T_grasp):
                return joints
            joints = np.clip(self._bullet.calculateInverseKinematics(
                self._arm, _GRASP_LINK, world_T_grasp.translation, world_T_grasp.rotation,
                maxNumIterations=100)[:7], self._lowest, self._highest)
        raise OutOfReach(f'the gripper cannot reach {world_T_grasp}')

    def _put(self, joints: Joints) -> None:
        for number, angle in enumerate(joints):
            self._bullet.resetJointState(self._arm, number, angle)

    def _is_at(self, world_T_grasp: Pose) -> bool:
        state = self._bullet.getLinkState(self._arm, _GRASP_LINK, computeForwardKinematics=True)
        error = Pose(*state[4], *state[5]).inverse() @ world_T_grasp
        return bool(np.linalg.norm(error.translation) < _CLOSE_M
                    and np.linalg.norm(error.as_rotation_vector()) < _CLOSE_RAD)
