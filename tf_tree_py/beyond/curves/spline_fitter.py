# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A spline that grows with the poses of a running sensor.

This file does not depend on the use of the spline, such as an edge of a buffer.

The last knots are updated with one pose at a time, by recursive least squares. A fit ends where
the gradients of all poses add up to zero, so a new pose contributes the only gradient, and one
step of the knots restores the sum of zero. The earlier poses stay in the normal matrix,
linearised where the knots were when they were added. That neglects terms of the second order in
the steps; ``spline_fit.fitted`` neglects nothing.
"""

from itertools import pairwise

import numpy as np
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.poses import PosesLike
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_stamp, from_seconds, NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import checked_cache_time, Stamps, StampsLike
from tf_tree_py.screws import Twist

from .spline import Spline
from .spline_fit import (
    basis_weights,
    checked_rate,
    checked_samples,
    first_guess,
    fitted,
    normal_bands,
    ORDER,
    places,
    SMALL_STEP,
)
from .spline_segment import Group, pose_on, SE3, SPLIT

# How far the new pose may be from the result of a linear step, as a share of its residual.
_NOT_LINEAR = 0.05


class RunningFit:
    """
    Adds poses on the last piece of a fitted spline. The formulas are on plain floats.

    :param group: the group of the spline.
    :param free: the number of the last knots that move, at least four.
    :param pieces: (N,) the pieces of the poses of the fit, by the number of the first knot.
    :param u: (N,) the place of each pose on its piece, 0 to 1.
    :param count: the number of knots.
    """

    def __init__(self, group: Group, free: int, pieces: Stamps, u: Array, count: int) -> None:
        self._group = group
        self._free = free
        self._bands = normal_bands(np.stack(basis_weights(u)), pieces, count)[:, -free:].copy()

    def add(self, knots: Array, steps: Array, u: float,
            pose: Array) -> tuple[Array, Array] | None:
        """
        Return the knots (n, 7) and steps (n - 1, 6) with another pose on the last piece.

        Return None if the step is too large to be linear: then all poses have to be fitted again.

        :param u: the place of the pose on the last piece, 0 to 1.
        :param pose: (7,) the measurement.
        """
        # Imported here because it takes long to load, and most programs fit nothing.
        from scipy.linalg import solveh_banded
        basis = basis_weights(u)
        for row in range(ORDER):
            for column in range(row, ORDER):
                self._bands[ORDER - 1 + row - column, column - ORDER] += basis[row] * basis[column]
        measured = pose.tolist()
        residual = np.array(self._step(self._on_last_piece(knots, steps, u), measured))
        slope = np.zeros((self._free, 6))
        slope[-ORDER:] = np.outer(basis, residual)
        tangents = solveh_banded(self._bands, slope, check_finite=False)
        knots, steps = self._moved(knots, steps, tangents)
        left = self._step(self._on_last_piece(knots, steps, u), measured)
        wrong = residual - basis @ tangents[-ORDER:] - left
        # At rest the residuals are rounding errors, and their shares mean nothing.
        if wrong @ wrong > max(_NOT_LINEAR**2 * (residual @ residual), SMALL_STEP**2):
            return None
        return knots, steps

    def _on_last_piece(self, knots: Array, steps: Array, u: float) -> PoseTuple:
        return pose_on(self._group, knots[-ORDER].tolist(), steps[1 - ORDER:].tolist(), u)

    def _moved(self, knots: Array, steps: Array, tangents: Array) -> tuple[Array, Array]:
        knots, steps = knots.copy(), steps.copy()
        group = self._group
        free = []
        for knot, tangent in zip(knots[-self._free:].tolist(), tangents.tolist(), strict=True):
            element = group.compose(knot, group.exp(tangent))
            free.append((*element[:3], *so3.normalize(element[3:])))
        knots[-self._free:] = free
        changed = knots[-self._free - 1:-self._free].tolist() + free
        steps[1 - len(changed):] = [self._step(a, b) for a, b in pairwise(changed)]
        return knots, steps

    def _step(self, a: PoseTuple, b: PoseTuple) -> Twist:
        """Return the tangent (6,) at element a that leads to b."""
        return self._group.log(self._group.compose(self._group.inverse(a), b))


# --- the growing spline

_CACHE_TIME = from_seconds(10.0)
# If a new pose moves the newest knot, the knot this many before it moves by 3e-5 of that: each
# knot moves by 2 - sqrt(3) of the movement of the next one.
_FREE_KNOTS = 8
# A gap between poses that needs more knots than this indicates a wrong stamp.
_MOST_NEW_KNOTS = 1_000_000


class SplineFitter:
    """
    Fits a spline to poses as they arrive.

    Each pose moves the last eight knots. Earlier knots are frozen: before ``frozen_until``, no
    answer ever changes. The newest piece is the least certain, because its last knots have few
    poses yet: its poses are good where samples are, and its acceleration is rough.

    A new piece refits the poses of the last eleven pieces. A single pose on the newest piece
    is one step of recursive least squares, which costs a fraction of that. Neither depends on
    the length of the spline. Not safe for several threads.

    :param knot_rate_hz: knots per second, at most half the rate of the poses if they are noisy.
    :param cache_time: how much of the spline is kept, nanoseconds; at least eight knots. After
        a longer time without a pose the spline starts again.
    :param on_se3: as in ``Spline.fit``.
    :ivar spline: the newest fit; None before the first pose.
    """

    def __init__(self, knot_rate_hz: float, *, cache_time: int = _CACHE_TIME,
                 on_se3: bool = False) -> None:
        self.cache_time = checked_cache_time(cache_time)
        self.spline: Spline | None = None
        self._period = max(1, round(NANOSECONDS_PER_SECOND / checked_rate(knot_rate_hz)))
        self._group = SE3 if on_se3 else SPLIT
        self._frozen = 0
        self._running: RunningFit | None = None
        # The poses on pieces with a free knot.
        self._stamps: Stamps = np.empty(0, dtype=np.int64)
        self._poses: Array = np.empty((0, 7))

    @property
    def frozen_until(self) -> int | None:
        """Return the stamp before which the spline is final; None before the first pose."""
        if self.spline is None:
            return None
        return self.spline.begin + max(self._frozen - ORDER + 1, 0) * self._period

    def add(self, stamps: StampsLike, poses: PosesLike) -> Spline:
        """
        Add poses, and return the new spline.

        :param stamps: (N,) nanoseconds, in any order, after ``frozen_until``.
        :param poses: (N, 7), or anything else that ``Spline.fit`` accepts.
        :raises InvalidArgumentException: older stamps, or arguments that ``Spline.fit`` refuses.
        """
        times, array = checked_samples(stamps, poses)
        spline = self.spline
        if spline is not None and int(times[0]) - spline.latest > max(
                self.cache_time, _FREE_KNOTS * self._period):
            self._start_anew()
            spline = None
        self._refuse_frozen(times)
        self._refuse_far(times, int(times[0]) if spline is None else spline.latest)
        updated = None
        if spline is not None and len(times) == 1:
            updated = self._updated(spline, int(times[0]), array[0])
        times, array = np.concatenate([self._stamps, times]), np.concatenate([self._poses, array])
        if updated is not None:
            self.spline, self._stamps, self._poses = updated, times, array
            return updated
        order = np.argsort(times, kind='stable')
        times, array = times[order], array[order]
        self.spline, self._running = self._refitted(spline, times, array), None
        self._forget(times, array)
        return self.spline

    def _updated(self, old: Spline, stamp: int, pose: Array) -> Spline | None:
        """Return the spline with another pose on its newest piece; None if a fit is needed."""
        begin = old.begin + (old.pieces - 1) * self._period
        if not old.latest <= stamp <= begin + self._period:
            return None
        if self._running is None:
            unseen = max(self._frozen - ORDER + 1, 0)
            numbers, u = places(self._stamps, old.begin, self._period, old.pieces)
            self._running = RunningFit(
                self._group, len(old) - self._frozen, numbers - unseen, u, len(old) - unseen)
        moved = self._running.add(old.knots, old.steps, (stamp - begin) / self._period, pose)
        if moved is None:
            return None
        knots, steps = moved
        return Spline(old.begin, self._period, knots, stamp, self._group, steps)

    def _refuse_frozen(self, times: Stamps) -> None:
        first, frozen = int(times[0]), self.frozen_until
        if frozen is not None and first < frozen:
            raise InvalidArgumentException(
                f'the pose at {format_stamp(first)} is too old: the spline is final before '
                f'{format_stamp(frozen)}')

    def _refuse_far(self, times: Stamps, latest: int) -> None:
        new = (int(times[-1]) - latest) // self._period
        if new > _MOST_NEW_KNOTS:
            raise InvalidArgumentException(
                f'the pose at {format_stamp(int(times[-1]))} would require {new} more knots: is '
                'its stamp correct?')

    def _refitted(self, old: Spline | None, stamps: Stamps, poses: Array) -> Spline:
        """Return the spline fitted to poses, with the frozen knots unchanged."""
        begin = int(stamps[0]) if old is None else old.begin
        latest = int(stamps[-1])
        pieces = max(1, -((begin - latest) // self._period))
        if old is not None:
            pieces = max(pieces, old.pieces)
        knots = first_guess(self._group, begin, self._period, pieces, stamps, poses,
                            None if old is None else old.knots)
        # Only frozen knots that influence a remaining pose are included in the fit.
        unseen = max(self._frozen - ORDER + 1, 0)
        numbers, u = places(stamps, begin, self._period, pieces)
        knots[unseen:] = fitted(self._group, knots[unseen:], self._frozen - unseen,
                                numbers - unseen, u, poses)
        return Spline(begin, self._period, knots, latest, self._group)

    def _forget(self, stamps: Stamps, poses: Array) -> None:
        """Freeze all but the last knots, and remove those older than the cache time."""
        spline = self.spline
        assert spline is not None and self.frozen_until is not None
        self._frozen = max(self._frozen, len(spline) - _FREE_KNOTS)
        kept = stamps >= self.frozen_until
        self._stamps, self._poses = stamps[kept], poses[kept]
        expired = (spline.latest - self.cache_time - spline.begin) // self._period
        dropped = min(max(expired, 0), max(self._frozen - ORDER + 1, 0))
        if dropped:
            self._frozen -= dropped
            self.spline = Spline(spline.begin + dropped * self._period, self._period,
                                 spline.knots[dropped:], spline.latest, self._group)

    def _start_anew(self) -> None:
        self.spline, self._running, self._frozen = None, None, 0
        self._stamps, self._poses = self._stamps[:0], self._poses[:0]
