# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One robot's transforms as bytes, fixed ones and those of joint states, without ROS.

In the messages of a publisher that sends the same edges again, only numbers change.
"""

from collections.abc import Callable, Iterable
from itertools import accumulate

import numpy as np
from tf_tree_py.core.edges.packed import POSE_BYTES
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.byte_cursor import ByteCursor, ENCAPSULATION_BYTES
from tf_tree_py.core.messages.sample import as_sec_nanosec, Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.urdf import Joint, Robot
from tf_tree_py.urdf.joint_states import JointStates, Rows
from tf_tree_py.urdf.joints import FIXED


class MessageTemplate:
    """
    One serialized message whose numbers are overwritten, at a tenth of the cost of ``write``.

    Each transform begins where the previous one ends, with its stamp, and ends with its pose.
    """

    def __init__(self, edges: Iterable[tuple[str, str]]) -> None:
        """
        Write the constant parts.

        :param edges: (parent, child) of each transform.
        """
        samples = [Sample(parent, child, LATEST, se3.IDENTITY) for parent, child in edges]
        self._data = bytearray(write(samples))
        # All transforms but the first begin at the same alignment.
        first = len(write(samples[:1]))
        ends = list(accumulate((len(write([samples[0], sample])) - first
                                for sample in samples[1:]), initial=first))[:len(samples)]
        self._words, self._doubles = (
            np.frombuffer(self._data, form, (len(self._data) - ENCAPSULATION_BYTES) // width,
                          ENCAPSULATION_BYTES) for form, width in (('<i4', 4), ('<f8', 8)))
        begins = np.array([ByteCursor.head, *ends][:len(samples)], np.intp)
        self._stamps = (begins - ENCAPSULATION_BYTES) // 4
        poses = np.array(ends, np.intp) - POSE_BYTES
        self._poses = (poses[:, None] - ENCAPSULATION_BYTES) // 8 + np.arange(7)

    def fill(self, stamp: int, poses: Array) -> bytes:
        """
        Return the message with one stamp, and with poses (edges, 7).

        :raises InvalidArgumentException: a stamp that no message can hold.
        """
        self._words[self._stamps], self._words[self._stamps + 1] = as_sec_nanosec(stamp)
        self._doubles[self._poses] = poses
        return bytes(self._data)


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
