# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses with frame names: ``a @ b`` composes them only if the inner names are equal.

This is a thin layer over ``Pose``, which has no names and costs less. If the names are literals
in annotations, such as ``FramedPose[Literal['map'], Literal['base']]``, mypy finds a wrong
composition before the program runs.
"""

from dataclasses import dataclass
from typing import Any, Generic, overload, TypeVar

import numpy as np
import numpy.typing as npt
import tf_tree_py
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import LATEST
from tf_tree_py.core.times import Stamp
from tf_tree_py.core.tree.queries import Queries

Target = TypeVar('Target', bound=str)
Source = TypeVar('Source', bound=str)
Other = TypeVar('Other', bound=str)


class FrameMismatchError(ValueError):
    """The frames of two operands do not match, so they cannot be composed."""


@dataclass(frozen=True, eq=False)
class FramedPoints(Generic[Source]):
    """
    Points with the frame of their coordinates.

    :ivar points: (3,) or (N, 3), metres.
    """

    frame: Source
    points: npt.ArrayLike

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        """Return the points as an array for numpy, which does not check names."""
        return np.array(self.points, dtype=float if dtype is None else dtype)


@dataclass(frozen=True)
class FramedPose(Generic[Target, Source]):
    """
    ``target_T_source`` with its names: it transforms coordinates in source to those in target.

    :ivar stamp: nanoseconds; None if it is composed of poses with different stamps.
    """

    target_frame: Target
    source_frame: Source
    pose: Pose
    stamp: int | None = None

    @overload
    def __matmul__(self, other: 'FramedPose[Source, Other]') -> 'FramedPose[Target, Other]': ...

    @overload
    def __matmul__(self, other: FramedPoints[Source]) -> FramedPoints[Target]: ...

    @overload
    def __matmul__(self, other: npt.ArrayLike) -> Array: ...

    def __matmul__(self, other: Any) -> object:
        """
        Compose with a pose, or transform points to the target; plain points are not checked.

        :raises FrameMismatchError: the inner names differ.
        """
        if isinstance(other, FramedPose):
            if other.target_frame != self.source_frame:
                raise FrameMismatchError(self._mismatch(other))
            stamp = self.stamp if self.stamp == other.stamp else None
            return FramedPose(
                self.target_frame, other.source_frame, self.pose @ other.pose, stamp)
        if isinstance(other, FramedPoints):
            if other.frame != self.source_frame:
                raise FrameMismatchError(
                    f'{self.name} takes points in {self.source_frame!r}, and these are in '
                    f'{other.frame!r}')
            return FramedPoints(self.target_frame, self.pose @ np.asarray(other))
        if isinstance(other, Pose):
            raise FrameMismatchError(
                f'{self.name} @ a Pose without names cannot be checked: compose the .pose of '
                "this one, or give the other one names, FramedPose('target', 'source', pose)")
        return self.pose @ other

    __array_ufunc__ = None  # numpy passes `array @ framed` to Python, which raises an error

    def _mismatch(self, other: 'FramedPose[Source, Other]') -> str:
        if self.target_frame == other.target_frame:
            meant = '; did you mean the inverse of the left one?'
        elif self.source_frame == other.source_frame:
            meant = '; did you mean the inverse of the right one?'
        elif self.target_frame == other.source_frame:
            meant = '; did you mean the opposite order?'
        else:
            meant = ''
        return (f'{self.name} @ {other.name}: {self.source_frame!r} is not '
                f'{other.target_frame!r}{meant}')

    @property
    def name(self) -> str:
        """Return ``target_T_source``, the usual name of such a variable."""
        return f'{self.target_frame}_T_{self.source_frame}'

    def inverse(self) -> 'FramedPose[Source, Target]':
        """Return source_T_target."""
        return FramedPose(self.source_frame, self.target_frame, self.pose.inverse(), self.stamp)

    def as_message(self) -> Any:
        """
        Return a ``geometry_msgs/TransformStamped``; this needs ROS.

        :raises FrameMismatchError: it has no stamp, because it is composed of several poses.
        :raises ImportError: ROS is not installed.
        """
        if self.stamp is None:
            raise FrameMismatchError(
                f'{self.name} is composed of poses with different stamps, so it has none: '
                'set one with dataclasses.replace(pose, stamp=...)')
        # The package knows all layers, and loads those that need ROS only for a public name.
        return tf_tree_py.transform_stamped(
            self.target_frame, self.source_frame, self.stamp, self.pose)

    def __str__(self) -> str:
        return f'{self.name}: {self.pose}'


# --- queries

class FramedQueries(Queries):
    """Lookups whose results have the names of their frames."""

    def lookup_framed(self, target_frame: Target, source_frame: Source,
                      stamp: Stamp = LATEST) -> FramedPose[Target, Source]:
        """
        Return the pose of ``lookup`` with its frames and its stamp.

        ``a @ b`` composes such poses only if their inner frame names are equal.
        """
        found, pose = self.lookup_stamped(target_frame, source_frame, stamp)
        return FramedPose(target_frame, source_frame, Pose._make(pose), found)
