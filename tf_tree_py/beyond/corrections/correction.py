# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The correction of one edge over time: how far its samples are moved at each stamp.

It is a smooth function of the stamp between successive corrections. Up to the newest sample it
never changes, so no correction changes the result of an earlier lookup.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable

import numpy as np
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array, Vector3
from tf_tree_py.core.stamp import BEGINNING
from tf_tree_py.core.times import Stamps
from tf_tree_py.files.edges import Arrays, Facts, Saved
from tf_tree_py.files.stamped_rows import StampedRows
from tf_tree_py.screws import cross

from .blend import BlendLimits, planned, scale_of
from .stage import ORIGIN, Stage, stage_of, Stages


def _no_turn() -> Vector3:
    return ORIGIN


class Correction:
    """
    Moves the samples of an edge that have one parent; see ``Stage``.

    :ivar stages: each correction with the transition to it.
    :ivar measured: every correction by the stamp at which it was measured.
    """

    __slots__ = ('stages', 'measured', '_limits')

    def __init__(self) -> None:
        self.stages = Stages(Stage(BEGINNING, BEGINNING, se3.IDENTITY))
        self.measured = Measured()
        self._limits: BlendLimits | None = None

    @property
    def stage(self) -> Stage:
        """Return the newest stage, whether in transition or reached."""
        return self.stages.newest

    def moved(self, stamp: int, pose: PoseTuple) -> PoseTuple:
        """Return a corrected sample."""
        return self.stages.at(stamp).moved(stamp, pose)

    # --- transitions

    def correct(self, motion: PoseTuple, begin: int, here: PoseTuple, about: Vector3,
                limits: BlendLimits, oldest: int,
                own_turn: Callable[[], Vector3] = _no_turn) -> Stage:
        """
        Begin the transition to another correction of the same samples, unless it is the same.

        The parameters are those of ``begin_blend``.
        """
        now = self.stage
        if (about, limits) == (now.about, self._limits) and _is_same(motion, now.motion):
            return now
        raw = self.stages.at(begin).raw(begin, here)
        return self.begin_blend(motion, begin, here, raw, about, limits, oldest, own_turn)

    def begin_blend(self, motion: PoseTuple, begin: int, here: PoseTuple, raw: PoseTuple,
                    about: Vector3, limits: BlendLimits, oldest: int,
                    own_turn: Callable[[], Vector3] = _no_turn) -> Stage:
        """
        Begin a transition to another correction or samples, from the present value and rate.

        :param begin: the stamp at which to begin, no earlier than the newest sample.
        :param here: the pose of the edge at that stamp.
        :param raw: the pose at that stamp in the samples that arrive from now on.
        :param about: the point of the child that moves no faster than the limits.
        :param oldest: stages that no sample from this stamp on needs are removed.
        :param own_turn: returns the angular velocity of the samples, in the parent's axes.
        """
        # Stages that begin no earlier than this one are replaced, so their rates do not apply.
        before, there = self.stages.at(begin), se3.compose(motion, raw)
        (x, y, z), (gx, gy, gz) = se3.apply(here, about), se3.apply(there, about)
        # Normalised, because otherwise rounding errors would double with every correction.
        turn = so3.normalize(so3.multiply(here[3:], so3.conjugate(there[3:])))
        offset = (x - gx, y - gy, z - gz, *turn)
        velocity, turning = _rates(before, begin, here, about, own_turn)
        plan = planned((*offset[:3], *so3.log(turn)), (*velocity, *turning), scale_of(limits),
                       before.plan)
        stage = stage_of(begin, motion, about, offset, plan)
        self.stages.add(stage, oldest)
        self._limits = limits
        return stage

    # --- results

    def pending(self, stamps: Stamps, poses: Array) -> Array:
        """
        Return how far poses (N, 7) of the edge are from their final, corrected poses.

        :return: (N, 6) of translation and rotation, as errors in ``uncertainty.covariances``.
        """
        there = self.stages.settled_many(stamps, self.stages.raw_many(stamps, poses))
        turned = so3.multiply_many(there[:, 3:], so3.conjugate_many(poses[:, 3:]))
        return np.concatenate([there[:, :3] - poses[:, :3], so3.log_many(turned)], axis=1)

    def is_settled(self, since: int) -> bool:
        """Return whether there is no pending correction from a stamp on."""
        return since > self.stage.begin and since >= self.stage.end

    # --- files

    def save(self, arrays: Arrays) -> Facts:
        """Return the facts for ``load``, and add the arrays."""
        return self.stages.save(arrays) | self.measured.save(arrays)

    @classmethod
    def load(cls, saved: Saved) -> 'Correction':
        """
        Return the saved correction; it takes no further corrections.

        :raises ValueError: the facts are not valid for a correction.
        """
        correction = cls()
        correction.stages = Stages.load(saved)
        correction.measured = Measured.load(saved)
        return correction

    def copy(self) -> 'Correction':
        """Return a copy."""
        twin = Correction()
        twin.stages, twin.measured = self.stages.copy(), self.measured.copy()
        twin._limits = self._limits
        return twin


def _is_same(a: PoseTuple, b: PoseTuple) -> bool:
    """Return whether two poses are equal; q and -q are the same rotation."""
    return a == b or (a[:3] == b[:3] and a[3:] == tuple(-part for part in b[3:]))


def _rates(before: Stage, begin: int, here: PoseTuple, about: Vector3,
           own_turn: Callable[[], Vector3]) -> tuple[Vector3, Vector3]:
    """
    Return the rates of a stage at a stamp: of the offset of a point, and of the rotation.

    A point other than the stage's own also has the velocity of the rotation. In addition it has
    Q (w x l) - w x l, with w the angular velocity of the goal and l the lever in the goal's axes:
    as long as the orientations of child and goal differ, the point moves differently in each.
    """
    velocity, turning = before.rates_at(begin)
    if about == before.about or begin >= before.end:
        return velocity, turning
    turn = before.offset_at(begin)[3]
    lever = so3.rotate(here[3:], _difference(about, before.about))
    own = so3.rotate(before.motion[3:], own_turn())
    ahead = cross(own, so3.rotate(so3.conjugate(turn), lever))
    (a, b, c), (d, e, f), (g, h, i) = cross(turning, lever), so3.rotate(turn, ahead), ahead
    x, y, z = velocity
    return (x + a + d - g, y + b + e - h, z + c + f - i), turning


def _difference(a: Vector3, b: Vector3) -> Vector3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


class Measured(StampedRows):
    """Corrections, sorted by the stamps at which they were measured: 64 bytes each."""

    __slots__ = ()

    width, name = 7, 'measured'

    def note(self, stamp: int, motion: PoseTuple, oldest: int) -> None:
        """Store a correction, and remove those that no sample from a stamp on needs."""
        self.add(bisect_right(self.stamps, stamp), stamp, motion)
        self.drop(0, max(bisect_left(self.stamps, oldest) - 1, 0))

    def smoothed(self, stamps: Stamps, raw: Array) -> Array:
        """
        Return samples with every correction applied from the stamp at which it was measured.

        Between two corrections the pose is interpolated between the results of both. The first
        one also applies before its stamp, and the last one after its stamp.

        :param raw: (N, 7) as received.
        """
        if not len(self):
            return raw
        _, _, before, after, ratio = self.around(stamps)
        return se3.interpolate_many(
            se3.compose_many(before, raw), se3.compose_many(after, raw), ratio)
