# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Insertion of curves, and of the angular velocities of gyroscopes, into a buffer."""

import math

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_AUTHORITY, PlainBuffer
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.sample import checked, checked_frame, Sample
from tf_tree_py.core.times import StampsLike

from .aided import aided
from .curve import as_edge_curve, Curve, EdgeCurve
from .curve_history import CurveHistory, on_curve


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
        rates = checked_rates(angular_velocities, len(times))
        order = np.argsort(times, kind='stable')
        with self._lock:
            history, gyroscope = aided(self._tree.histories.get(child), child,
                                       self._tree.cache_time)
            self._tree.replace(history)
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
        elif not (on_curve(history) and history.parent == parent
                  and history.replace(curve, authority)):
            incidents = intake.tree.insert_history(
                CurveHistory(child, parent, curve, authority), parent, curve.oldest, authority)
        intake.count(not (incidents and incidents[-1].refused), incidents)
        return incidents

    return intake.insert([newest], authority, insert=insert)


def checked_rates(given: npt.ArrayLike, count: int) -> Array:
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
