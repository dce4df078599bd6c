# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The simplest motion in continuous time: one twist between two stamps."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.edges.storage import Arrays, Facts, Stored
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.poses import checked_pose
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import BEGINNING, FOREVER, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_stamp, Stamps


@dataclass(frozen=True)
class ConstantTwist:
    """
    A ``Curve`` along one screw: ``pose`` at ``oldest``, then ``pose`` exp(t ``twist``).

    Lynch, Park, "Modern Robotics", section 3.3.3.

    :ivar oldest: the beginning, nanoseconds; ``latest``: the end.
    :ivar pose: ``parent_T_child`` at ``oldest``: anything that ``insert`` accepts as a pose.
    :ivar twist: six numbers, metres and radians per second, in the child's axes: forwards at
        1 m/s is (1, 0, 0, 0, 0, 0).
    """

    oldest: int
    latest: int
    pose: Pose
    twist: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the arguments."""
        given: Any = self.pose
        set_to = object.__setattr__  # the only way to set a frozen dataclass
        set_to(self, 'oldest', checked_stamp(self.oldest))
        set_to(self, 'latest', checked_stamp(self.latest))
        set_to(self, 'pose', Pose._make(checked_pose(given)))
        set_to(self, 'twist', _checked_twist(self.twist))

    def poses(self, stamps: Stamps) -> Array:
        """Return (N, 7), one for each of (N,) stamps."""
        since = (stamps - self.oldest) / NANOSECONDS_PER_SECOND
        steps = se3.exp_many(since[:, None] * np.array(self.twist))
        return se3.compose_many(np.array(self.pose), steps)

    def twists(self, stamps: Stamps) -> Array:
        """Return (N, 6), the same twist for each stamp."""
        return np.tile(np.array(self.twist), (len(stamps), 1))

    def frozen(self) -> 'ConstantTwist':
        """Return this curve, because files support its kind."""
        return self

    def stored(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add the numbers to arrays."""
        arrays.add(np.array([*self.pose, *self.twist]))
        return {'oldest': self.oldest, 'latest': self.latest}

    @classmethod
    def thawed(cls, stored: Stored) -> 'ConstantTwist':
        """Return the stored curve."""
        numbers = stored.floats(13).tolist()
        return cls(stored.whole('oldest', BEGINNING, FOREVER - 1),
                   stored.whole('latest', BEGINNING, FOREVER - 1),
                   Pose._make(numbers[:7]), tuple(numbers[7:]))


def _checked_twist(given: npt.ArrayLike) -> tuple[float, ...]:
    try:
        twist = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        twist = np.empty(0)
    if twist.shape != (6,) or not np.isfinite(twist).all():
        raise InvalidArgumentException(
            f'Invalid argument twist {given!r:.80}: it must be six finite numbers, metres per '
            'second along x, y, z and radians per second about them')
    return tuple(twist.tolist())
