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

"""
The history of an edge that absorbs corrections: its samples are moved as they come in.

So a lookup finds poses as in any other edge, and costs no more. The original samples can be
computed at any time, for the correction is known.
"""

from typing import TypeGuard, TypeVar

import numpy as np

from .aided import AidedHistory
from .correction import Correction, Measured, ORIGIN, Stage
from .discrete import DynamicHistory, HeldHistory
from .packed import pack_pose, unpack_pose
from .protocol import History
from .storage import Arrays, Facts, Stored
from ..errors import InvalidArgumentException
from ..geometry import se3
from ..geometry.blend import Limits
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array, Vector3
from ..stamp import BEGINNING, FOREVER
from ..times import Stamps

_Kind = TypeVar('_Kind', bound='CorrectedHistory')


class CorrectedHistory(DynamicHistory):
    """
    Samples that a correction moves; see the top of the file.

    :ivar correction: what moves them.
    """

    # Two subclasses have the slot, for with one here the second could not be an AidedHistory too.
    __slots__ = ()

    correction: Correction

    # --- what arrives

    def append(self, stamp: int, pose: bytes) -> bool:
        """Take the next sample; see ``History.append``."""
        moved = self.correction.moved(stamp, unpack_pose(pose))
        return super().append(stamp, pack_pose(*moved))

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Take a sample; see ``History.insert``."""
        if parent == self.correction.parent:
            pose = self.correction.moved(stamp, pose)
        return super().insert(stamp, parent, pose)

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Take many samples; see ``MovingHistory.extend``."""
        super().extend(stamps, self.correction.moved_many(stamps, poses))

    # --- corrections

    def absorb(self, motion: PoseTuple, seen_at: int | None, about: Vector3,
               limits: Limits) -> Stage:
        """
        Go over to another correction, from the newest sample on.

        :param seen_at: the stamp at which it was measured; None: that of the newest sample.
        :param about: the point of the child that ``max_speed`` holds for.
        """
        begin, here = self._newest()
        raw = self.correction.raw_many(np.array([begin]), np.array([here]))[0].tolist()
        oldest = begin - self.cache_time
        stage = self.correction.go_over(motion, begin, here, tuple(raw), about, limits, oldest)
        self.correction.note(Measured(begin if seen_at is None else seen_at, motion), oldest)
        return stage

    def change_source(self, raw: PoseTuple, limits: Limits) -> Stage:
        """
        Go over to the samples of another source, from the newest sample on.

        :param raw: that source's pose then.
        """
        begin, here = self._newest()
        stage = self.correction.go_over(se3.IDENTITY, begin, here, raw, ORIGIN, limits,
                                        begin - self.cache_time)
        self.correction.measured.clear()
        return stage

    def _newest(self) -> tuple[int, PoseTuple]:
        """Return the newest stamp, and where the child is then."""
        begin = self.latest_stamp
        assert begin is not None and self.parent is not None
        if self.correction.parent != self.parent:
            self._begin(Correction(self.parent, begin))
        return begin, self.sample(begin)

    def pending(self, stamps: Stamps, poses: Array) -> Array | None:
        """Return what is still to be corrected, None if nothing is; see ``Correction``."""
        if stamps.min() >= self.correction.stage.fade.end:
            return None
        return self.correction.pending(stamps, poses)

    def smoothed(self) -> DynamicHistory:
        """Return the samples with all corrections applied to the past; see ``Correction``."""
        twin = self.plain()
        if not len(self):
            return twin
        stamps, poses = self.copy_between(BEGINNING, FOREVER - 1)
        named = np.array([self.parent_at(stamp) == self.correction.parent
                          for stamp in stamps.tolist()])
        poses[named] = self.correction.smoothed(
            stamps[named], self.correction.raw_many(stamps[named], poses[named]))
        twin.set_poses(poses)
        return twin

    # --- copies

    def frozen(self, arrays: Arrays) -> Facts:
        """Return the facts for ``thawed``, and add to arrays what is in the window."""
        return super().frozen(arrays) | {'correction': self.correction.frozen()}

    @classmethod
    def thawed(cls: type[_Kind], child: str, stored: Stored) -> _Kind:
        """Return what was frozen, which uses the memory where it lies; nothing can be added."""
        history = super().thawed(child, stored)
        history._begin(Correction.thawed(stored.part('correction')))
        return history

    def clear(self) -> None:
        """Forget every sample, and the corrections: they were of another time."""
        super().clear()
        self._begin(Correction('', BEGINNING))

    def _begin(self, correction: Correction) -> None:
        self.correction = correction  # type: ignore[misc]  # a slot of the subclasses

    def copy(self: _Kind) -> _Kind:
        """Return a history of its own with the same samples."""
        twin = super().copy()
        twin._begin(self.correction.copy())
        return twin

    def plain(self) -> DynamicHistory:
        """Return a history of its own with the same samples, which absorbs no corrections."""
        return self.copied_into(DynamicHistory(self.child, self.cache_time, self.authority))


class CorrectedSamples(CorrectedHistory):
    """Samples that a correction moves, interpolated between."""

    __slots__ = ('correction',)


class CorrectedAidedSamples(CorrectedHistory, AidedHistory):
    """Samples that a correction moves, and between which a gyroscope tells the rotation."""

    __slots__ = ('correction',)

    def plain(self) -> AidedHistory:
        """Return a history of its own with the same samples, which absorbs no corrections."""
        twin = self.copied_into(AidedHistory(self.child, self.cache_time, self.authority))
        twin.gyro = self.gyro.copy()
        return twin


def can_be_corrected(history: History | None) -> TypeGuard[DynamicHistory]:
    """Return whether an edge moves between samples, which a correction can move."""
    return isinstance(history, DynamicHistory) and not isinstance(history, HeldHistory)


def corrected(history: History | None, child: str) -> CorrectedHistory:
    """
    Return an edge's history as one that absorbs corrections: itself, or a new one.

    :raises InvalidArgumentException: an edge without samples, or that does not move between
        them.
    """
    if history is None or history.parent is None:
        raise InvalidArgumentException(
            f'Nothing is known of an edge of {child!r}, or it has ended: a correction moves the '
            'samples of an edge, and begins at the newest one. Insert one first')
    if isinstance(history, CorrectedHistory):
        return history
    if not can_be_corrected(history):
        what = ('is static, so answers for any stamp may have been given, and a correction would '
                'change them' if history.is_static else f'is {history.kind}, not samples')
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} {what}. Insert it as one that moves, with '
            'stamps, or correct another edge between the two frames')
    return with_correction(history, Correction(history.parent, BEGINNING))


def with_correction(history: DynamicHistory, correction: Correction) -> CorrectedHistory:
    """Return a history with these samples as they are, which moves those to come."""
    twin: CorrectedHistory
    if isinstance(history, AidedHistory):
        twin = history.copied_into(CorrectedAidedSamples(
            history.child, history.cache_time, history.authority))
        twin.gyro = history.gyro.copy()
    else:
        twin = history.copied_into(CorrectedSamples(
            history.child, history.cache_time, history.authority))
    twin._begin(correction)
    return twin
