# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot whose joints are set by hand, which a page shows while there are no transforms."""

import threading
from typing import Final, NamedTuple

from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.urdf import Joint, Robot

# The range of a slider for a joint without limits: plus or minus radians or metres.
_UNLIMITED: Final = 3.15


class Slider(NamedTuple):
    """The range of one joint variable and its position at rest, radians or metres."""

    variable: str
    least: float
    most: float
    rest: float


class RestingRobot:
    """
    The transforms of a robot at joint positions that are set by hand.

    :ivar buffer: contains the transforms, as static ones.
    :ivar sliders: the joint variables that can be set.
    :ivar positions: the variables that have been set, radians or metres.
    """

    def __init__(self, robot: Robot) -> None:
        """Begin with all joints at rest."""
        self._robot = robot
        self._lock = threading.Lock()
        self.positions: dict[str, float] = {}
        self.buffer = BufferCore(UNLIMITED)
        self.sliders = [slider for joint in robot.moving if joint.mimic is None
                        for slider in _sliders(joint)]
        self._put()

    def move(self, variable: str, position: float) -> None:
        """Set the position of a joint; joints that mimic it follow."""
        with self._lock:
            self.positions[variable] = position
            self._put()

    def _put(self) -> None:
        for (parent, child), pose in self._robot.edges(self.positions).items():
            self.buffer.insert(parent, child, 0, Pose(*pose.tolist()), static=True)


def _sliders(joint: Joint) -> list[Slider]:
    """Return the slider of a joint; none for planar and floating joints."""
    if joint.joint_type not in ('revolute', 'continuous', 'prismatic'):
        return []
    least, most = joint.limits or (-_UNLIMITED, _UNLIMITED)
    return [Slider(variable, min(least, rest), max(most, rest), rest)
            for variable, rest in zip(joint.variables, joint.rest, strict=True)]
