# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of an edge that absorbs corrections: each new sample is moved when it arrives.

So lookups find poses as in any other edge that is computed in Python. The original samples can
be computed at any time, because the correction is stored.
"""

from collections.abc import Callable, Iterator

import numpy as np
from tf_tree_py.core.edges.interpolation import Interpolation, LINEAR
from tf_tree_py.core.edges.packed import pack_pose, unpack_pose
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.stamp import BEGINNING, FOREVER, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps
from tf_tree_py.files.edges import Arrays, Facts, in_files, load_samples, save_samples, Saved

from .blend import BlendLimits
from .correction import Correction, Measured
from .stage import ORIGIN, Stage


@in_files('corrected')
class CorrectedSamples(Samples):
    """
    Samples that corrections move; see the module docstring.

    :ivar corrections: the corrections by parent; the child may change its parent.
    """

    __slots__ = ('corrections',)

    def __init__(self, child: str, cache_time: int, authority: str = '',
                 interpolation: Interpolation = LINEAR) -> None:
        super().__init__(child, cache_time, authority, interpolation)
        self.corrections: dict[str, Correction] = {}

    # --- inserting

    def append(self, stamp: int, pose: bytes) -> bool:
        """Insert the next sample; see ``History.append``."""
        correction = self.corrections.get(self.parent or '')
        if correction is not None:
            pose = pack_pose(*correction.moved(stamp, unpack_pose(pose)))
        return super().append(stamp, pose)

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Insert a sample; see ``History.insert``."""
        correction = self.corrections.get(parent)
        if correction is not None:
            pose = correction.moved(stamp, pose)
        return super().insert(stamp, parent, pose)

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Insert many samples; see ``MovingHistory.extend``."""
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
        correction.measured = Measured()
        return stage

    def _newest(self) -> tuple[int, PoseTuple, Correction]:
        """Return the newest stamp, the pose at that stamp, and its correction."""
        begin, parent = self.newest_stamp, self.parent
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

    def original(self) -> Samples:
        """Return the samples as received."""
        return self._with_poses(lambda correction, stamps, raw: raw)

    def smoothed(self) -> Samples:
        """Return the samples with all corrections applied to the past; see ``Measured``."""
        return self._with_poses(
            lambda correction, stamps, raw: correction.measured.smoothed(stamps, raw))

    def _with_poses(self, change: Callable[[Correction, Stamps, Array], Array]) -> Samples:
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

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the samples in the window to arrays."""
        return save_samples(self, arrays) | {'corrections': [
            {'parent': parent} | correction.save(arrays)
            for parent, correction in self.corrections.items()]}

    @classmethod
    def load(cls, child: str, saved: Saved) -> 'CorrectedSamples':
        """Return saved samples; they use the memory in place, and nothing can be added."""
        history = load_samples(cls, child, saved)
        history.corrections = {part.one('parent', str): Correction.load(part)
                               for part in saved.parts('corrections')}
        return history

    def clear(self) -> None:
        """Remove all samples and corrections, because they belong to another time."""
        super().clear()
        self.corrections = {}

    def copy(self) -> 'CorrectedSamples':
        """Return an independent history with the same samples."""
        twin = super().copy()
        twin.corrections = {parent: each.copy() for parent, each in self.corrections.items()}
        return twin

    def plain(self) -> Samples:
        """Return an independent history with the same samples, which absorbs no corrections."""
        return self.copied_into(Samples(
            self.child, self.cache_time, self.authority, self.interpolation.copy()))


def corrected(history: History | None, child: str) -> CorrectedSamples:
    """
    Return an edge's history as one that absorbs corrections: itself, or a new one.

    :raises InvalidArgumentException: an edge without samples, or one that is not interpolated
        between them.
    """
    if history is None or history.parent is None:
        raise InvalidArgumentException(
            f'{child!r} has no edge with samples, or its edge has ended: a correction moves the '
            'samples of an edge, and begins at the newest one. Insert a sample first')
    if isinstance(history, CorrectedSamples):
        return history
    if not isinstance(history, Samples):
        what = ('is static, and a correction would change results that were already returned'
                if history.is_static else f'is {history.described_as}, not samples')
        raise InvalidArgumentException(
            f'The edge {history.parent} -> {child} {what}. Insert it as a moving edge, with '
            'stamps, or correct another edge between the two frames')
    return with_corrections(history, {})


def with_corrections(history: Samples, corrections: dict[str, Correction]) -> CorrectedSamples:
    """Return a history with these samples unchanged, which moves later samples."""
    twin = history.copied_into(CorrectedSamples(
        history.child, history.cache_time, history.authority, history.interpolation.copy()))
    twin.corrections = corrections
    return twin
