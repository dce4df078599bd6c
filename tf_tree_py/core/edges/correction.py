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
The correction of one edge over time: by how much its samples are moved at each stamp.

It is a function of the stamp that goes smoothly from each correction to the next. Up to the
newest sample it never changes, so no correction changes an answer that was given.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .storage import Facts, Stored
from ..geometry import se3, so3
from ..geometry.blend import Fade, fade, Limits, Rates
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array, Vector3
from ..times import Stamps

ORIGIN = (0.0, 0.0, 0.0)


class Stage(NamedTuple):
    """
    One correction, and how the edge goes over to it.

    In the end a sample stands at motion @ parent_T_child. Until then a point of the child is
    d away from there, and the child is turned about that point by Q. Both fade. So the
    point moves with its own speed and that of the fading, and no faster, wherever the child
    goes.

    :ivar about: that point, in the child.
    """

    motion: PoseTuple
    fade: Fade
    about: Vector3

    def moved(self, stamp: int, pose: PoseTuple) -> PoseTuple:
        """Return a sample, moved by the correction at its stamp."""
        pose = se3.compose(self.motion, pose)
        if stamp >= self.fade.end:
            return pose
        dx, dy, dz, *turn = self.fade.at(stamp)
        q = so3.multiply((turn[0], turn[1], turn[2], turn[3]), pose[3:])
        (bx, by, bz), (ax, ay, az) = so3.rotate(pose[3:], self.about), so3.rotate(q, self.about)
        return (pose[0] + dx + bx - ax, pose[1] + dy + by - ay, pose[2] + dz + bz - az, *q)

    def moved_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return samples (N, 7), moved by the correction at their stamps (N,)."""
        poses = se3.compose_many(np.array(self.motion), poses)
        fading = stamps < self.fade.end
        if fading.any():
            poses[fading] = self._offset(poses[fading], self.fade.at_many(stamps[fading]))
        return poses

    def raw(self, stamps: Stamps, poses: Array) -> Array:
        """Return poses (N, 7) as they came in: the inverse of ``moved_many``."""
        fading = stamps < self.fade.end
        if fading.any():
            poses = poses.copy()
            poses[fading] = self._without(poses[fading], self.fade.at_many(stamps[fading]))
        return se3.compose_many(se3.inverse_many(np.array(self.motion)), poses)

    def _offset(self, poses: Array, offsets: Array) -> Array:
        q = so3.multiply_many(offsets[:, 3:], poses[:, 3:])
        t = poses[:, :3] + offsets[:, :3] + self._arms(poses[:, 3:]) - self._arms(q)
        return np.concatenate([t, q], axis=1)

    def _without(self, poses: Array, offsets: Array) -> Array:
        q = so3.multiply_many(so3.conjugate_many(offsets[:, 3:]), poses[:, 3:])
        t = poses[:, :3] - offsets[:, :3] + self._arms(poses[:, 3:]) - self._arms(q)
        return np.concatenate([t, q], axis=1)

    def _arms(self, q: Array) -> Array:
        """Return the vector from the child's origin to the point, in the parent's axes."""
        return so3.rotate_many(q, np.broadcast_to(self.about, (len(q), 3)))


class Measured(NamedTuple):
    """A correction, and the stamp at which it was measured."""

    stamp: int
    motion: PoseTuple


class Correction:
    """
    Moves the samples of an edge; see ``Stage``.

    :ivar parent: of the edge that it corrects; the child may change its parent.
    :ivar measured: every correction, sorted by the stamp at which it was measured.
    """

    __slots__ = ('parent', 'measured', '_stages', '_begins')

    def __init__(self, parent: str, since: int) -> None:
        """
        Begin without a correction.

        :param since: the earliest stamp at which the first one may begin, nanoseconds.
        """
        self.parent = parent
        self.measured: list[Measured] = []
        self._stages = [Stage(se3.IDENTITY, Fade(since, since, se3.IDENTITY, Rates()), ORIGIN)]
        self._begins = [since]

    @property
    def stage(self) -> Stage:
        """Return the newest stage, which the edge goes over to or has reached."""
        return self._stages[-1]

    def moved(self, stamp: int, pose: PoseTuple) -> PoseTuple:
        """Return a sample, moved."""
        # At the stamp where a stage begins the one before it holds: answers were given by that.
        return self._stages[max(bisect_left(self._begins, stamp) - 1, 0)].moved(stamp, pose)

    def moved_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return samples (N, 7), moved."""
        return self._by_stage(stamps, poses, Stage.moved_many)

    def raw_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return poses (N, 7) of the edge as they came in."""
        return self._by_stage(stamps, poses, Stage.raw)

    def settled_many(self, stamps: Stamps, poses: Array) -> Array:
        """Return samples (N, 7) where they will stand in the end, without the fading."""
        return self._by_stage(stamps, poses, lambda stage, _, some: se3.compose_many(
            np.array(stage.motion), some))

    def _by_stage(self, stamps: Stamps, poses: Array,
                  change: Callable[[Stage, Stamps, Array], Array]) -> Array:
        which = np.maximum(np.searchsorted(self._begins, stamps, side='left') - 1, 0)
        changed = np.empty((len(stamps), 7))
        for index in np.unique(which).tolist():
            chosen = which == index
            changed[chosen] = change(self._stages[index], stamps[chosen], poses[chosen])
        return changed

    # --- going over

    def go_over(self, motion: PoseTuple, begin: int, here: PoseTuple, raw: PoseTuple,
                about: Vector3, limits: Limits, oldest: int) -> Stage:
        """
        Go over to another correction, or other samples, from the present value and rate.

        :param begin: the stamp at which to begin, no earlier than the newest sample.
        :param here: the pose of the edge at that stamp.
        :param raw: the pose at that stamp in the samples that come from now on.
        :param oldest: stages that no sample from this stamp on needs are forgotten.
        """
        before, there = self.stage, se3.compose(motion, raw)
        point = se3.apply(here, about)
        # Normalised, for otherwise rounding errors would double with every correction.
        turn = so3.normalize(so3.multiply(here[3:], so3.conjugate(there[3:])))
        offset = (*np.subtract(point, se3.apply(there, about)).tolist(), *turn)
        velocity, turning = before.fade.rates_at(begin)
        arm = np.subtract(point, se3.apply(here, before.about))
        x, y, z = (velocity + np.cross(turning, arm)).tolist()
        stage = Stage(motion, fade(offset, Rates((x, y, z), turning), begin, limits), about)
        self._begin(stage, oldest)
        return stage

    def _begin(self, stage: Stage, oldest: int) -> None:
        """Add a stage; it replaces all that begin after it."""
        while self._begins and self._begins[-1] >= stage.fade.begin:
            del self._begins[-1], self._stages[-1]
        self._begins.append(stage.fade.begin)
        self._stages.append(stage)
        expired = max(bisect_left(self._begins, oldest) - 1, 0)
        del self._begins[:expired], self._stages[:expired]

    def note(self, measured: Measured, oldest: int) -> None:
        """Keep a correction for ``smoothed``, and forget those that no sample needs any more."""
        insort(self.measured, measured, key=lambda one: one.stamp)
        expired = bisect_left(self.measured, oldest, key=lambda one: one.stamp) - 1
        del self.measured[:max(expired, 0)]

    # --- what follows

    def pending(self, stamps: Stamps, poses: Array) -> Array:
        """
        Return how far poses (N, 7) of the edge are from where they will stand in the end.

        :return: (N, 6) of translation and rotation, as ``geometry.covariances`` has errors.
        """
        there = self.settled_many(stamps, self.raw_many(stamps, poses))
        turned = so3.multiply_many(there[:, 3:], so3.conjugate_many(poses[:, 3:]))
        return np.concatenate([there[:, :3] - poses[:, :3], so3.log_many(turned)], axis=1)

    def smoothed(self, stamps: Stamps, raw: Array) -> Array:
        """
        Return samples with every correction applied from the stamp at which it was measured.

        Between two corrections the pose is interpolated between the results of both. Before
        the first and after the last, that one holds.

        :param raw: (N, 7) as they came in.
        """
        if not self.measured:
            return raw
        knots = np.array([one.stamp for one in self.measured])
        motions = np.array([one.motion for one in self.measured])
        after = np.searchsorted(knots, stamps, side='right')
        before = np.maximum(after - 1, 0)
        after = np.minimum(after, len(knots) - 1)
        ratio = np.where(before < after, (stamps - knots[before]) / np.maximum(
            knots[after] - knots[before], 1), 0.0)
        return se3.interpolate_many(se3.compose_many(motions[before], raw),
                                    se3.compose_many(motions[after], raw), ratio)

    # --- files

    def frozen(self) -> Facts:
        """Return the facts for ``thawed``."""
        return {'parent': self.parent,
                'measured': [[one.stamp, *one.motion] for one in self.measured],
                'stages': [[stage.fade.begin, stage.fade.end, *stage.motion, *stage.fade.offset,
                            *stage.fade.rates.velocity, *stage.fade.rates.turning, *stage.about]
                           for stage in self._stages]}

    @classmethod
    def thawed(cls, stored: Stored) -> 'Correction':
        """
        Return what was frozen.

        :raises ValueError: the facts cannot be those of a correction.
        """
        correction = cls(stored.one('parent', str), 0)
        correction.measured = [Measured(stamp, _tuple(motion)) for stamp, *motion
                               in stored.rows('measured', 1, 7)]
        correction._stages = [
            Stage(_tuple(rest[:7]), Fade(begin, end, _tuple(rest[7:14]), Rates(
                _tuple(rest[14:17]), _tuple(rest[17:20]))), _tuple(rest[20:]))
            for begin, end, *rest in stored.rows('stages', 2, 23)]
        correction._begins = [stage.fade.begin for stage in correction._stages]
        if not correction._begins or correction._begins != sorted(correction._begins):
            raise ValueError("'stages' do not follow each other")
        return correction

    def copy(self) -> 'Correction':
        """Return a copy."""
        twin = Correction(self.parent, self._begins[0])
        twin.measured = list(self.measured)
        twin._stages, twin._begins = list(self._stages), list(self._begins)
        return twin


def _tuple(numbers: Sequence[float]) -> Any:
    return tuple(numbers)
