# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of an edge that absorbs corrections: each new sample is moved when it arrives.

So lookups find poses as in any other edge, at the same cost. The original samples can be
computed at any time, because the correction is stored.
"""

from collections.abc import Callable, Iterator
from typing import TypeGuard, TypeVar

import numpy as np
from tf_tree_py.core.edges.histories import DynamicHistory, HeldHistory
from tf_tree_py.core.edges.packed import pack_pose, unpack_pose
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.storage import Arrays, Facts, Stored
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.stamp import BEGINNING, FOREVER, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps
from tf_tree_py.core.tree.frozen import storable

from .blend import BlendLimits
from .correction import Correction
from .stage import ORIGIN, Stage
from ..curves.aided import AidedHistory

_Kind = TypeVar('_Kind', bound='CorrectedHistory')


class CorrectedHistory(DynamicHistory):
    """
    Samples that corrections move; see the module docstring.

    :ivar corrections: the corrections by parent; the child may change its parent.
    """

    # The two subclasses have the slot: with a slot here, the second could not be an AidedHistory.
    __slots__ = ()

    corrections: dict[str, Correction]

    # --- inserting

    def append(self, stamp: int, pose: bytes, unpacked: PoseTuple | None = None) -> bool:
        """Take the next sample; see ``History.append``."""
        correction = self.corrections.get(self.parent or '')
        if correction is not None:
            unpacked = correction.moved(stamp, unpacked or unpack_pose(pose))
            pose = pack_pose(*unpacked)
        return super().append(stamp, pose, unpacked)

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Take a sample; see ``History.insert``."""
        correction = self.corrections.get(parent)
        if correction is not None:
            pose = correction.moved(stamp, pose)
        return super().insert(stamp, parent, pose)

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Take many samples; see ``MovingHistory.extend``."""
        correction = self.corrections.get(self.parent or '')
        if correction is not None:
            poses = correction.stages.moved_many(stamps, poses)
        super().extend(stamps, poses)

    # --- corrections

    def absorb(self, motion: PoseTuple, seen_at: int | None, about: Vector3,
               limits: BlendLimits) -> Stage:
        """
        Begin the transition to another correction at the newest sample.

        :param seen_at: the stamp at which it was measured; None: that of the newest sample.
        :param about: the point of the child to which ``max_speed`` applies.
        """
        begin, here, correction = self._newest()
        oldest = begin - self.cache_time
        stage = correction.correct(motion, begin, here, about, limits, oldest,
                                   lambda: self._own_turn(correction))
        correction.measured.note(begin if seen_at is None else seen_at, motion, oldest)
        return stage

    def change_source(self, raw: PoseTuple, limits: BlendLimits) -> Stage:
        """
        Begin the transition to the samples of another source at the newest sample.

        :param raw: that source's pose at the stamp of the newest sample.
        """
        begin, here, correction = self._newest()
        stage = correction.begin_blend(se3.IDENTITY, begin, here, raw, ORIGIN, limits,
                                       begin - self.cache_time, lambda: self._own_turn(correction))
        correction.measured.clear()
        return stage

    def _newest(self) -> tuple[int, PoseTuple, Correction]:
        """Return the newest stamp, the pose at that stamp, and its correction."""
        begin, parent = self.latest_stamp, self.parent
        assert begin is not None and parent is not None
        correction = self.corrections.get(parent)
        if correction is None:
            correction = self.corrections[parent] = Correction()
        return begin, self.sample(begin), correction

    def _own_turn(self, correction: Correction) -> Vector3:
        """Return the angular velocity of the last two samples as received."""
        stamps, poses = self.copy_between(FOREVER - 1, FOREVER - 1)
        before = self.copy_between(int(stamps[-1]) - 1, int(stamps[-1]) - 1)
        first, last = int(before[0][0]), int(stamps[-1])
        if first >= last or self.parent_at(first) != self.parent:
            return ORIGIN
        stages = correction.stages
        begin, end = (stages.at(stamp).raw(stamp, tuple(pose.tolist()))
                      for stamp, pose in ((first, before[1][0]), (last, poses[-1])))
        x, y, z = so3.log(so3.multiply(end[3:], so3.conjugate(begin[3:])))
        rate = NANOSECONDS_PER_SECOND / (last - first)
        return (rate * x, rate * y, rate * z)

    def stage(self) -> Stage | None:
        """Return the newest stage of the corrections; None before the first."""
        correction = self.corrections.get(self.parent or '')
        return None if correction is None else correction.stage

    def pending(self, stamps: Stamps, poses: Array) -> Array | None:
        """Return the pending correction, None if there is none; see ``Correction``."""
        since = int(stamps.min())
        if all(each.is_settled(since) for each in self.corrections.values()):
            return None
        poses = np.broadcast_to(poses, (len(stamps), 7))
        pending = np.zeros((len(stamps), 6))
        for correction, named in self._named_at(stamps):
            pending[named] = correction.pending(stamps[named], poses[named])
        return pending

    def _named_at(self, stamps: Stamps) -> Iterator[tuple[Correction, Array]]:
        """Yield each correction, and a mask of the stamps at which it applies."""
        if self.fixed_parent:
            parents = np.full(len(stamps), self.parent)
        else:
            parents = np.array([self.parent_at(stamp) for stamp in stamps.tolist()])
        for parent, correction in self.corrections.items():
            named = parents == parent
            if named.any():
                yield correction, named

    def original(self) -> DynamicHistory:
        """Return the samples as received."""
        return self._with_poses(lambda correction, stamps, raw: raw)

    def smoothed(self) -> DynamicHistory:
        """Return the samples with all corrections applied to the past; see ``Measured``."""
        return self._with_poses(
            lambda correction, stamps, raw: correction.measured.smoothed(stamps, raw))

    def _with_poses(self, change: Callable[[Correction, Stamps, Array], Array]) -> DynamicHistory:
        twin = self.plain()
        if not len(self):
            return twin
        stamps, poses = self.copy_between(BEGINNING, FOREVER - 1)
        for correction, named in self._named_at(stamps):
            some = stamps[named]
            poses[named] = change(correction, some, correction.stages.raw_many(
                some, poses[named]))
        twin.set_poses(poses)
        return twin

    # --- copies

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add the samples in the window to arrays."""
        return super().frozen(arrays) | {'corrections': [
            {'parent': parent} | correction.frozen(arrays)
            for parent, correction in self.corrections.items()]}

    @classmethod
    def thawed(cls: type[_Kind], child: str, stored: Stored) -> _Kind:
        """Return the frozen data; it uses the memory in place, and nothing can be added."""
        history = super().thawed(child, stored)
        history._begin({part.one('parent', str): Correction.thawed(part)
                        for part in stored.parts('corrections')})
        return history

    def clear(self) -> None:
        """Remove all samples and corrections, because they belong to another time."""
        super().clear()
        self._begin({})

    def _begin(self, corrections: dict[str, Correction]) -> None:
        self.corrections = corrections  # type: ignore[misc]  # a slot of the subclasses

    def copy(self: _Kind) -> _Kind:
        """Return an independent history with the same samples."""
        twin = super().copy()
        twin._begin({parent: each.copy() for parent, each in self.corrections.items()})
        return twin

    def plain(self) -> DynamicHistory:
        """Return an independent history with the same samples, which absorbs no corrections."""
        return self.copied_into(DynamicHistory(self.child, self.cache_time, self.authority))


@storable('corrected')
class CorrectedSamples(CorrectedHistory):
    """Samples that corrections move, with interpolation between them."""

    __slots__ = ('corrections',)

    def aided(self) -> 'CorrectedAidedSamples':
        """Return these samples with a gyroscope, which has no samples yet."""
        history = self.copied_into(AidedHistory(self.child, self.cache_time, self.authority))
        return _with_gyroscope(history, self.corrections)


@storable('corrected and aided')
class CorrectedAidedSamples(CorrectedHistory, AidedHistory):
    """Samples that corrections move, with a gyroscope for the rotation between them."""

    __slots__ = ('corrections',)

    def plain(self) -> AidedHistory:
        """Return an independent history with the same samples, which absorbs no corrections."""
        twin = self.copied_into(AidedHistory(self.child, self.cache_time, self.authority))
        twin.gyro = self.gyro.copy()
        return twin


def can_be_corrected(history: History | None) -> TypeGuard[DynamicHistory]:
    """Return whether an edge has interpolated samples, which corrections can move."""
    return isinstance(history, DynamicHistory) and not isinstance(history, HeldHistory)


def corrected(history: History | None, child: str) -> CorrectedHistory:
    """
    Return an edge's history as one that absorbs corrections: itself, or a new one.

    :raises InvalidArgumentException: an edge without samples, or one that is not interpolated
        between them.
    """
    if history is None or history.parent is None:
        raise InvalidArgumentException(
            f'{child!r} has no edge with samples, or its edge has ended: a correction moves the '
            'samples of an edge, and begins at the newest one. Insert a sample first')
    if isinstance(history, CorrectedHistory):
        return history
    if not can_be_corrected(history):
        what = ('is static, and a correction would change results that were already returned'
                if history.is_static else f'is {history.kind}, not samples')
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} {what}. Insert it as a moving edge, with '
            'stamps, or correct another edge between the two frames')
    return with_corrections(history, {})


def with_corrections(history: DynamicHistory,
                     corrections: dict[str, Correction]) -> CorrectedHistory:
    """Return a history with these samples unchanged, which moves later samples."""
    if isinstance(history, AidedHistory):
        return _with_gyroscope(history, corrections)
    twin = history.copied_into(CorrectedSamples(
        history.child, history.cache_time, history.authority))
    twin._begin(corrections)
    return twin


def _with_gyroscope(history: AidedHistory,
                    corrections: dict[str, Correction]) -> CorrectedAidedSamples:
    twin = history.copied_into(CorrectedAidedSamples(
        history.child, history.cache_time, history.authority))
    twin.gyro = history.gyro.copy()
    twin._begin(corrections)
    return twin
