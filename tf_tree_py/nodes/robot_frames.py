# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One robot's transforms as bytes, fixed ones and those of joint states, without ROS."""

from collections.abc import Callable

import numpy as np
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.urdf import Joint, Robot
from tf_tree_py.urdf.joint_states import JointStates, Rows
from tf_tree_py.urdf.joints import FIXED

from .message_template import MessageTemplate

# The maximum number of stencils, one for each set of edges that are sent together.
_MAX_STENCILS = 64


class RobotFrames:
    """
    Turns joint states into the bytes of TFMessages.

    :ivar robot: the robot.
    """

    def __init__(self, robot: Robot, frame_prefix: str, interval: int | None,
                 tell: Callable[[str, str], object], before: 'RobotFrames | None' = None) -> None:
        """
        Start without joint states.

        :param frame_prefix: the prefix of every link's name.
        :param interval: the minimum time between two messages of the same joint, nanoseconds;
            None: no minimum.
        :param tell: called with each problem of the joint states: its kind, and a sentence.
        :param before: an earlier object, whose positions joints of the same names keep.
        """
        self.robot = robot
        self._prefix, self._interval = frame_prefix, interval
        self._states = JointStates(robot, tell)
        self._stencils: dict[bytes, MessageTemplate] = {}
        if before is not None:
            self._states.resume(before._states, before.robot)

    def fixed(self, stamp: int) -> bytes:
        """Return all fixed transforms, for /tf_static."""
        return write([
            Sample(*self._edge(joint), stamp, (*joint.origin[:3],
                                               *so3.with_tf2_sign(joint.origin.rotation)))
            for joint in self.robot.joints if joint.joint_type == FIXED])

    def moved(self, stamp: int, names: tuple[str, ...], positions: Array) -> bytes | None:
        """Return the transforms that joint states move, for /tf; None if none is due."""
        rows = self._states.update(stamp, names, positions, self._interval)
        return None if rows is None else self._message(stamp, rows)

    def again(self) -> bytes | None:
        """Return the known moving transforms, a nanosecond later; None if there are none."""
        known = self._states.again()
        return None if known is None else self._message(*known)

    def _message(self, stamp: int, rows: Rows) -> bytes:
        poses = self._states.poses()[rows]
        poses[:, 3:] = so3.with_tf2_sign_many(poses[:, 3:])
        return self._stencil(rows).fill(stamp, poses)

    def _stencil(self, rows: Rows) -> MessageTemplate:
        stencil = self._stencils.get(rows.tobytes())
        if stencil is None:
            if len(self._stencils) >= _MAX_STENCILS:
                self._stencils.clear()
            stencil = self._stencils[rows.tobytes()] = MessageTemplate(
                self._edge(self.robot.moving[row]) for row in np.flatnonzero(rows))
        return stencil

    def _edge(self, joint: Joint) -> tuple[str, str]:
        """Return the names of a joint's frames, without the slash that listeners strip."""
        parent, child = ((self._prefix + link).removeprefix('/') for link in joint.edge)
        return parent, child
