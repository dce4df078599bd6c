# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of an edge that is one curve in continuous time, and its insertion into a buffer.

It takes no samples. A newer curve from elsewhere replaces this one. The angular velocities of
gyroscopes are inserted here, too.
"""

from array import array
from collections.abc import Iterator
from functools import partial
import math
from typing import TypeGuard

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_AUTHORITY, PlainBuffer
from tf_tree_py.core.edges.packed import Columns
from tf_tree_py.core.edges.protocol import EdgeTrack, History, Stretch
from tf_tree_py.core.errors import (
    ExtrapolationException,
    FutureExtrapolationException,
    InvalidArgumentException,
    no_truth,
    NoDataException,
    PastExtrapolationException,
    TreeFileError,
)
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import checked, checked_frame, Sample
from tf_tree_py.core.stamp import FOREVER, UNLIMITED
from tf_tree_py.core.times import Stamps, StampsLike
from tf_tree_py.files.edges import Arrays, Facts, in_files, Saved

from .aided import aided, gyro_until, note_rates
from .curve import as_edge_curve, ConstantTwist, Curve, EdgeCurve
from .spline import Spline

_SAVED_CURVES: dict[str, type[Spline | ConstantTwist]] = {
    'spline': Spline, 'constant twist': ConstantTwist}
"""The curves that files support: their ``load`` raises a ValueError for invalid data."""


@in_files('curve')
class CurveHistory:
    """
    One edge on a curve; see ``MovingHistory``.

    :ivar curve: None after ``clear``.
    """

    __slots__ = ('child', 'parent', 'authority', 'curve')

    described_as = 'a curve'
    is_static = False
    takes_samples = False
    fixed_parent = True
    # The creator of the curve decides how much of it is kept.
    cache_time = UNLIMITED
    late = FOREVER

    def __init__(self, child: str, parent: str | None, curve: EdgeCurve | None,
                 authority: str = '') -> None:
        self.child = child
        self.parent = parent
        self.curve = curve
        self.authority = authority

    def __len__(self) -> int:
        return 0 if self.curve is None else len(self.curve)

    __bool__ = no_truth

    @property
    def oldest_stamp(self) -> int | None:
        """Return the first stamp of the curve, nanoseconds."""
        return None if self.curve is None else self.curve.oldest

    @property
    def latest_stamp(self) -> int | None:
        """Return the last stamp of the curve, nanoseconds."""
        return None if self.curve is None else self.curve.latest

    newest_stamp = latest_stamp

    # --- poses

    def sample(self, stamp: int) -> PoseTuple:
        """
        Return the edge's pose at a stamp.

        :raises ExtrapolationException: the stamp is outside the curve.
        """
        curve = self.curve
        if curve is None or not curve.oldest <= stamp <= curve.latest:
            raise self.extrapolation(stamp)
        return curve.sample(stamp)

    def neighbours(self, first: int, last: int) -> tuple[float, ...] | None:
        """Return the poses at two stamps; None if one is outside the curve."""
        curve = self.curve
        if curve is None or not curve.oldest <= first < last <= curve.latest:
            return None
        return self.sample(first) + self.sample(last)

    def track(self, first: int, last: int) -> EdgeTrack:
        """Return a track for lookups at many stamps; the curve never changes."""
        assert self.curve is not None
        return self.curve.track(first, last)

    def twists(self, stamps: Stamps) -> Array | None:
        """Return the twists of the child; None if the curve has none."""
        assert self.curve is not None
        return self.curve.twists(stamps)

    # --- the parent

    def parent_at(self, stamp: int) -> str | None:
        """Return the parent, if the stamp is within the curve."""
        curve = self.curve
        inside = curve is not None and curve.oldest <= stamp <= curve.latest
        return self.parent if inside else None

    def possible_parents(self, stamp: int) -> set[str] | None:
        """Return the parent, unless the stamp is older than the curve; None without one."""
        if self.parent is None:
            return None
        return set() if self.is_too_old(stamp) else {self.parent}

    def parents_between(self, begin: int, end: int) -> Iterator[Stretch]:
        """Yield the parent, from the beginning of the curve on."""
        if self.curve is not None and self.parent is not None:
            yield self.parent, self.curve.oldest, FOREVER

    def has_named(self, parent: str) -> bool:
        """Return whether this is the parent."""
        return parent == self.parent

    def next_turn(self, stamp: int) -> int:
        """Return how far the curve must reach to change the result at a stamp."""
        latest = self.latest_stamp
        if latest is None or self.is_too_old(stamp):
            return FOREVER
        # The next curve may begin later, so the time of this one may be lost.
        return max(stamp, latest + 1)

    # --- inserting

    def replace(self, curve: EdgeCurve, authority: str) -> bool:
        """Insert another curve unless it begins later, which may change paths; return whether."""
        if self.curve is None or self.curve.oldest > curve.oldest:
            return False
        self.curve, self.authority = curve, authority
        return True

    def append(self, stamp: int, pose: bytes) -> bool:
        """Return False: a curve takes no sample."""
        return False

    def continues(self, parent: str, stamp: int, pose: PoseTuple) -> bool:
        """Return False: a sample changes the kind of the edge."""
        return False

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Return False: a curve takes no sample."""
        return False

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Do nothing; this is never called, because ``takes_samples`` is False."""

    def is_too_old(self, stamp: int) -> bool:
        """Return whether a stamp is older than the curve: the next one will not begin earlier."""
        return self.curve is not None and stamp < self.curve.oldest

    def next_stamp(self, stamp: int) -> int:
        """Return the first stamp of the curve if it is newer, else ``FOREVER``."""
        oldest = self.oldest_stamp
        return oldest if oldest is not None and stamp < oldest else FOREVER

    def fell_silent(self, stamp: int) -> bool:
        """Return False: a curve never counts as silent; ``remove_frame`` removes it."""
        return False

    def end(self) -> None:
        """Do nothing, because it never counts as silent."""

    def clear(self) -> None:
        """Remove the curve."""
        self.curve = self.parent = None

    def copy(self) -> 'CurveHistory':
        """Return an independent history with the same curve, which never changes."""
        return CurveHistory(self.child, self.parent, self.curve, self.authority)

    def columns(self) -> Columns:
        """Return poses on the curve, for programs that interpolate."""
        curve = self.curve
        if curve is None:
            return Columns(memoryview(array('q')), memoryview(array('d')), None, ())
        stamps = curve.shown_at()
        poses = np.ascontiguousarray(curve.poses(stamps))
        return Columns(memoryview(stamps), memoryview(poses.ravel()), None, ())

    def save(self, arrays: Arrays) -> Facts:
        """
        Return the facts for ``load``, and add the curve to arrays.

        :raises TreeFileError: the curve is of a kind that files do not support.
        """
        if self.curve is None:
            return {'parent': None, 'curve': None}
        kept = self.curve.saved_as()
        for name, cls in _SAVED_CURVES.items():
            if type(kept) is cls:
                return {'parent': self.parent, 'curve': {'kind': name} | kept.save(arrays)}
        raise TreeFileError(
            'files support curves of the classes Spline and ConstantTwist: give it a method '
            'saved_as() that returns one of these')

    @classmethod
    def load(cls, child: str, saved: Saved) -> 'CurveHistory':
        """Return the saved history, whose curve uses the memory in place."""
        if not saved.has('curve'):
            return cls(child, None, None)
        parent, part = saved.one('parent', str), saved.part('curve')
        name = part.one('kind', str)
        if name not in _SAVED_CURVES:
            raise ValueError(f'unknown kind of curve {name!r}')
        return cls(child, parent,
                   as_edge_curve(_SAVED_CURVES[name].load(part), f'{parent} -> {child}'))

    def extrapolation(self, stamp: int) -> ExtrapolationException:
        """Return the error for a stamp outside the curve."""
        curve = self.curve
        if curve is None:
            return NoDataException(child=self.child, requested=stamp)
        cls: type[ExtrapolationException] = PastExtrapolationException
        if stamp > curve.latest:
            cls = FutureExtrapolationException
        return cls(parent=self.parent, child=self.child, requested=stamp, oldest=curve.oldest,
                   latest=curve.latest, hint=partial(_hint, stamp > curve.latest))


def _hint(ends: bool, live: bool) -> str:
    if not ends:
        return 'The edge is a curve that begins later'
    if live:
        return ('The edge is a curve, and is not extrapolated: wait for a longer one, with a '
                'timeout')
    return 'The edge is a curve that ends earlier, and is not extrapolated'


def _on_curve(history: History | None) -> TypeGuard[CurveHistory]:
    """Return whether there is a history, and it is that of a curve."""
    return history is not None and not history.takes_samples


# --- insertion into a buffer

class CurveBuffer(PlainBuffer):
    """A buffer that takes curves, and the angular velocities of gyroscopes."""

    def insert_curve(self, parent: str, child: str, curve: Curve, *,
                     authority: str = DEFAULT_AUTHORITY,
                     strict: bool | None = None) -> list[Incident]:
        """
        Replace the samples of an edge with a curve, which is valid from its begin to its end.

        A curve is a ``Spline``, a ``ConstantTwist``, or any other function of time: see
        ``Curve``. It replaces all stored samples of the edge, or its previous curve. So the
        spline of a ``SplineFitter`` can be inserted after every ``add``. A sample that is
        inserted later turns the edge into a sampled one again. The whole curve is kept,
        regardless of ``cache_time``.

        :param curve: ``parent_T_child`` over time; it must not change after the insertion.
        :param strict: as in ``insert``.
        :return: the incidents: empty if it was inserted without a remark.
        :raises InvalidArgumentException: not a curve, or a name that is not a string.
        :raises RefusedException: with ``strict``, if it was refused.
        """
        for name, frame in (('parent', parent), ('child', child)):
            if not isinstance(frame, str):
                raise InvalidArgumentException(f'{name} is the name of a frame, not {frame!r}')
        parent, child = parent.removeprefix('/'), child.removeprefix('/')
        return self._refusals.report(insert_curve(
            self.intake, parent, child, as_edge_curve(curve, f'{parent} -> {child}'),
            authority), strict)

    def aid(self, child: str, stamps: StampsLike, angular_velocities: npt.ArrayLike, *,
            max_gap: int | None = None, saturation: float = math.inf) -> int:
        """
        Insert angular velocities of a gyroscope, for lookups between an edge's poses.

        Between two poses, lookups follow the rotation that the gyroscope measured, corrected so
        that it agrees with both poses. A gap of up to 0.1 s is bridged from what was measured
        before and after it. In a longer one the rotation is interpolated as before. Translations
        and the poses themselves do not change.

        :param child: the edge's child frame; its poses may arrive later.
        :param stamps: (N,) nanoseconds.
        :param angular_velocities: (N, 3) radians per second, of the child relative to the
            parent, in the child's axes: the measurements of a gyroscope in the child if the
            parent, such as odom, does not rotate.
        :param max_gap: the longest time between two samples, nanoseconds; a longer one is a gap.
            None: five of its usual periods.
        :param saturation: the largest rate about one axis that it can measure, radians per
            second; if a sample reaches it, the time from the sample before to the sample after
            counts as a gap.
        :return: how many were inserted: those that are newer than all previous ones.
        :raises InvalidArgumentException: mismatched shapes, rates that are not finite,
            invalid stamps or limits, or an edge that is static or a curve.
        """
        if not (max_gap is None or isinstance(max_gap, int) and max_gap > 0) or not (
                saturation > 0.0):
            raise InvalidArgumentException(
                f'max_gap={max_gap!r} must be integer nanoseconds or None, and '
                f'saturation={saturation!r} radians per second; both must be positive')
        times = self._stamps_of(stamps)
        child = checked_frame(child)
        rates = _checked_rates(angular_velocities, len(times))
        order = np.argsort(times, kind='stable')
        with self._lock:
            history, gyroscope = aided(self._tree.histories.get(child), child,
                                       self._tree.cache_time)
            self._tree.replace(history)
            if len(times):
                note_rates(history, gyro_until(history), int(times.min()))
            return gyroscope.insert_rates(times[order], rates[order], max_gap, saturation)


def insert_curve(intake: Intake, parent: str, child: str, curve: EdgeCurve,
                 authority: str) -> list[Incident]:
    """
    Replace an edge by a curve, whatever its kind, and notify observers of its newest pose.

    The stamp of that pose is compared with the clock. For a curve that reaches into the
    future, it is the stamp of its oldest pose.
    """
    stamp = curve.oldest if intake.is_too_far(curve.latest) else curve.latest
    newest = Sample(parent, child, stamp, curve.sample(stamp))

    def insert(good: list[Sample], authority: str, static: bool) -> list[Incident]:
        if not good:
            return []  # its stamp was refused
        sound, history = checked(newest, authority), intake.tree.histories.get(child)
        incidents: list[Incident] = []
        if isinstance(sound, Incident):
            incidents = [sound]
        elif not (_on_curve(history) and history.parent == parent
                  and history.replace(curve, authority)):
            incidents = intake.tree.insert_history(
                CurveHistory(child, parent, curve, authority), parent, curve.oldest, authority)
        intake.count(not (incidents and incidents[-1].refused), incidents)
        return incidents

    return intake.insert([newest], authority, insert=insert)


def _checked_rates(given: npt.ArrayLike, count: int) -> Array:
    """
    Return a caller's angular velocities as an array (N, 3).

    :raises InvalidArgumentException: another shape, or numbers that are not finite.
    """
    try:
        rates = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InvalidArgumentException('angular velocities are (N, 3) numbers') from None
    if rates.shape != (count, 3) and (count or rates.size):
        raise InvalidArgumentException(
            f'angular velocities are (N, 3), one for each of {count} stamps, not {rates.shape}')
    if not np.isfinite(rates).all():
        raise InvalidArgumentException('some angular velocities are not finite')
    return rates.reshape(count, 3)
