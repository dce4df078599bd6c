# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How an edge moves between its samples, and for how long it holds the newest one.

This is the seam for other policies: an object that a history of samples asks, not a kind of
history. ``Linear`` is tf2's, and that of nearly all edges.

An interpolation reads the samples and never changes them. Single lookups call it with the lock of
their buffer or snapshot held, lookups at many stamps without it. One object may serve many edges
and snapshots, so several threads may call it at once; unless it keeps data of an edge: then
``copy`` must return an independent one.
"""

from typing import ClassVar

from .packed import PackedSamples, POSE_BYTES, unpack_pair
from .protocol import EdgeTrack
from .tracks import InterpolatedTrack, OneByOneTrack
from ..errors import InvalidArgumentException
from ..geometry.chain import between_samples, PoseTuple
from ..geometry.poses import checked_pose, is_sound


class Interpolation:
    """
    The poses between samples; a subclass defines ``between``.

    :cvar name: its name in files. If it has something to save, it also needs a method ``save`` and
        a class method ``load``, as in docs/interpolation.md.
    :ivar holds_for: how long the newest sample is valid after its stamp, nanoseconds. It must not
        change.
    """

    name: ClassVar[str] = ''
    holds_for: int = 0

    def between(self, samples: PackedSamples, index: int, stamp: int) -> PoseTuple:
        """
        Return ``parent_T_child`` at a stamp between two samples with the same parent.

        :param samples: of the edge: ``stamps[index]`` is less than the stamp, and
            ``stamps[index + 1]`` is greater; ``pose(index)`` returns a pose.
        :param stamp: nanoseconds.
        """
        raise NotImplementedError(f'{type(self).__name__} must define between()')

    def pose(self, samples: PackedSamples, index: int, stamp: int) -> PoseTuple:
        """
        Return ``between``, checked, because it may be a user's.

        :raises InvalidArgumentException: it raised an exception, or returned no pose.
        """
        try:
            found: object = self.between(samples, index, stamp)
        except Exception as error:
            raise _wrong(self, samples, f'raised {error!r}') from error
        try:
            pose = checked_pose(found)
        except InvalidArgumentException as error:
            raise _wrong(self, samples, f'returned no pose: {error}') from error
        if not is_sound(pose):
            raise _wrong(self, samples, f'returned {pose}, which is not finite, or whose '
                         'quaternion does not have length one')
        return pose

    def track(self, samples: PackedSamples, first: int, last: int) -> EdgeTrack:
        """
        Return a copy of the data for lookups at many stamps, all from ``first`` to ``last``.

        By default it calls ``between`` for each stamp, with a copy of the samples around these
        stamps, and two more on either side.
        """
        few, begin = samples.part(samples.index_before(first), last, beside=2)
        pose = self.copy().pose
        return OneByOneTrack(*samples.copy_between(first, last),
                             lambda index, stamp: pose(few, begin + index, stamp))

    # --- only for data of the edge

    def copy(self) -> 'Interpolation':
        """Return this object, or an independent one if it has data of the edge."""
        return self

    def clear(self) -> None:
        """Remove the data of the edge, whose samples were removed."""

    def forget(self) -> None:
        """Remove what was computed from samples, because some of them have changed."""

    def followed_by(self, other: 'Interpolation') -> 'Interpolation':
        """Return what replaces it if a caller chooses another interpolation for the edge."""
        return other


def _wrong(interpolation: Interpolation, samples: PackedSamples,
           what: str) -> InvalidArgumentException:
    return InvalidArgumentException(
        f'{type(interpolation).__name__}.between, the interpolation of the edge above '
        f'{samples.child!r}, {what}')


class Linear(Interpolation):
    """Linear translation, and rotation at constant speed the short way, as in tf2."""

    name = 'linear'

    def between(self, samples: PackedSamples, index: int, stamp: int) -> PoseTuple:
        """Return the pose at a stamp between two samples; see ``between_samples``."""
        return between_samples(unpack_pair(samples.poses, index * POSE_BYTES), stamp,
                               samples.stamps[index], samples.stamps[index + 1])

    def track(self, samples: PackedSamples, first: int, last: int) -> EdgeTrack:
        """Return a copy of the samples that lookups between two stamps need."""
        if not is_linear(self):
            return super().track(samples, first, last)
        return InterpolatedTrack(*samples.copy_between(first, last))


LINEAR = Linear()


def is_linear(interpolation: Interpolation) -> bool:
    """Return whether the poses between samples are those of ``Linear``."""
    return type(interpolation).between is Linear.between


def checked_interpolation(given: object) -> Interpolation:
    """
    Return a caller's interpolation.

    :raises InvalidArgumentException: it is none, or its ``holds_for`` is not a span of time.
    """
    if not isinstance(given, Interpolation):
        hint = ': pass an object, not the class' if isinstance(given, type) else ''
        raise InvalidArgumentException(f'{given!r} is not an Interpolation{hint}')
    if type(given.holds_for) is not int or given.holds_for < 0:
        raise InvalidArgumentException(
            f'holds_for of {type(given).__name__} is {given.holds_for!r}, and must be integer '
            'nanoseconds, at least 0')
    return given
