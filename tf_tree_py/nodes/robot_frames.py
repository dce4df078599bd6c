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

"""One robot's transforms as bytes: those that never change, and those of joint states; no ROS."""

from collections.abc import Callable

import numpy as np
from tf_tree_py.core.arrivals.sample import Sample
from tf_tree_py.core.arrivals.stencil import Stencil
from tf_tree_py.core.arrivals.wire import write
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.urdf import Joint, Robot
from tf_tree_py.urdf.joints import FIXED
from tf_tree_py.urdf.states import JointStates, Rows

# Different sets of edges that are sent together; each has its stencil.
_MAX_STENCILS = 64


class RobotFrames:
    """
    Turns joint states into the bytes of TFMessages.

    :ivar robot: whose frames.
    """

    def __init__(self, robot: Robot, frame_prefix: str, interval: int | None,
                 tell: Callable[[str], object], before: 'RobotFrames | None' = None) -> None:
        """
        Begin where nothing was reported yet.

        :param frame_prefix: goes before every link's name.
        :param interval: how long after a joint was sent it may be sent again, nanoseconds;
            None: no matter when.
        :param tell: hears in a sentence what of the joint states cannot be used, each once.
        :param before: whose positions are taken over; the joints of the same names have them.
        """
        self.robot = robot
        self._prefix, self._interval = frame_prefix, interval
        self._states = JointStates(robot, tell)
        self._stencils: dict[bytes, Stencil] = {}
        if before is not None:
            self._states.resume(before._states, before.robot)

    def fixed(self, stamp: int) -> bytes:
        """Return what never changes, all of it: for /tf_static."""
        return write([
            Sample(*self._edge(joint), stamp, (*joint.origin[:3],
                                               *so3.with_tf2_sign(joint.origin.rotation)))
            for joint in self.robot.joints if joint.kind == FIXED])

    def moved(self, stamp: int, names: tuple[str, ...], positions: Array) -> bytes | None:
        """Return what joint states move: for /tf. None if that is nothing, or comes too soon."""
        rows = self._states.take(stamp, names, positions, self._interval)
        return None if rows is None else self._message(stamp, rows)

    def again(self) -> bytes | None:
        """Return what is known already, a nanosecond later; None if that is nothing."""
        known = self._states.again()
        return None if known is None else self._message(*known)

    def _message(self, stamp: int, rows: Rows) -> bytes:
        poses = self._states.poses()[rows]
        poses[:, 3:] = so3.with_tf2_sign_many(poses[:, 3:])
        return self._stencil(rows).fill(stamp, poses)

    def _stencil(self, rows: Rows) -> Stencil:
        stencil = self._stencils.get(rows.tobytes())
        if stencil is None:
            if len(self._stencils) >= _MAX_STENCILS:
                self._stencils.clear()
            stencil = self._stencils[rows.tobytes()] = Stencil(
                self._edge(self.robot.moving[row]) for row in np.flatnonzero(rows))
        return stencil

    def _edge(self, joint: Joint) -> tuple[str, str]:
        """Return the names of a joint's frames, without the slash that listeners take off."""
        parent, child = ((self._prefix + link).removeprefix('/') for link in joint.edge)
        return parent, child
