# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Observations of a target by a sensor, poses or points with stamps; and what is known before."""

from dataclasses import dataclass
import math

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.errors import no_truth


class CalibrationError(ValueError):
    """A calibration is not possible: one sentence with the reason and the remedy."""


@dataclass(frozen=True)
class Limits:
    """
    What counts as observable, and which time offsets are tried.

    :ivar known_m: the standard deviation to which a mounting is known without calibration,
        metres; directions that the observations determine less precisely are not estimated.
    :ivar known_rad: likewise for rotations, radians.
    :ivar known_s: likewise for time offsets, seconds.
    :ivar least_turn_rad: smaller rotations (root mean square) of the edge's parent do not
        count as showing a translation: they may be noise of the poses.
    :ivar max_offset_s: the largest time offset that is tried, seconds.
    """

    known_m: float = 0.1
    known_rad: float = 0.1
    known_s: float = 0.1
    least_turn_rad: float = math.radians(0.5)
    max_offset_s: float = 0.5


# --- observations

Array = npt.NDArray[np.float64]
Stamps = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

_UNIT = 1e-3
"""The largest difference of a quaternion's length from one."""


@dataclass(frozen=True)
class Observations:
    """
    Poses or points of one target, observed by one sensor.

    Observations that are not finite are dropped, and so are duplicates. The arrays are copied.

    :ivar sensor: the frame of the observations, ``header.frame_id``.
    :ivar stamps: (N,) integer nanoseconds, by the clock of the sensor.
    :ivar seen: ``sensor_T_target`` (N, 7), x y z qx qy qz qw; or points (N, 3).
    :ivar fixed_in: the frame in which the target rests; this frame may move.
    :ivar target: a name. Observations with the same name and ``fixed_in`` are of one target.
    :ivar place: the place of the target, ``fixed_in_T_target`` (7,), or (3,) for points; None:
        it is estimated.
    :ivar covariances: (N, p, p), or (p, p) for all, with p = 6 for poses, in the convention of
        ``PoseWithCovariance``, and p = 3 for points. If they are None, or if one has a variance
        of zero, the spread is estimated.
    """

    sensor: str
    stamps: Stamps
    seen: Array
    fixed_in: str
    target: str = 'target'
    place: Array | None = None
    covariances: Array | None = None

    def __post_init__(self) -> None:
        """
        Check and copy the arrays.

        :raises CalibrationError: shapes do not match, stamps are not integers, or quaternions
            do not have unit length.
        """
        stamps, seen = np.asarray(self.stamps), _numbers(self.seen, 'seen')
        if stamps.ndim != 1 or (len(stamps) and stamps.dtype.kind not in 'iu'):
            raise CalibrationError('stamps must be (N,) integer nanoseconds; convert '
                                   'seconds with tf_tree_py.core.from_seconds')
        if seen.ndim != 2 or seen.shape[1] not in (3, 7) or len(seen) != len(stamps):
            raise CalibrationError(
                f'{len(stamps)} stamps need as many poses (N, 7) or points (N, 3), '
                f'not {seen.shape}')
        size = 6 if seen.shape[1] == 7 else 3
        covariances = _checked_covariances(self.covariances, len(stamps), size)
        kept = np.isfinite(seen).all(axis=1)
        if covariances is not None:
            kept &= np.isfinite(covariances).all(axis=(1, 2))
        stamps, seen = stamps[kept].astype(np.int64), _unit(seen[kept])
        order = _in_order_and_once(stamps, seen)
        place = None if self.place is None else _unit(_numbers(self.place, 'place')[None])[0]
        if place is not None and place.shape != seen.shape[1:]:
            raise CalibrationError(f'the place of {self.target!r} has the shape {place.shape}, '
                                   f'and what was seen of it {seen.shape[1:]}')
        for name, value in (
                ('stamps', stamps[order]), ('seen', seen[order]), ('place', place),
                ('covariances', None if covariances is None else covariances[kept][order])):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        """Return the number of observations."""
        return len(self.stamps)

    __bool__ = no_truth

    @property
    def size(self) -> int:
        """Return the size of a residual: 6 for poses, 3 for points."""
        return 6 if self.seen.shape[1] == 7 else 3

    @property
    def name(self) -> tuple[str, str]:
        """Return the identity of the target."""
        return self.fixed_in, self.target


def _in_order_and_once(stamps: Stamps, seen: Array) -> npt.NDArray[np.intp]:
    """Return the order by stamps, without duplicates: repeated evidence is no new evidence."""
    if not len(stamps):
        return np.zeros(0, dtype=np.intp)
    order = np.lexsort((*seen.T, stamps))
    again = (stamps[order][1:] == stamps[order][:-1]) & np.all(
        seen[order][1:] == seen[order][:-1], axis=1)
    return np.asarray(order[np.concatenate([[True], ~again])])


def _numbers(given: object, name: str) -> Array:
    try:
        return np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise CalibrationError(f'{name} must be an array of numbers, not {given!r:.60}') from None


def _unit(seen: Array) -> Array:
    """Return poses with unit quaternions; points as they are."""
    if seen.shape[-1] != 7:
        return seen
    lengths = np.linalg.norm(seen[:, 3:], axis=1)
    if (np.abs(lengths - 1.0) > _UNIT).any():
        raise CalibrationError('a quaternion of an observed pose does not have the length 1')
    return np.concatenate([seen[:, :3], seen[:, 3:] / lengths[:, None]], axis=1)


def _checked_covariances(given: object, count: int, size: int) -> Array | None:
    if given is None:
        return None
    covariances = _numbers(given, 'covariances')
    if covariances.shape not in ((size, size), (count, size, size)):
        raise CalibrationError(f'covariances must be ({size}, {size}) or (N, {size}, {size}), not '
                               f'{covariances.shape}')
    made = np.array(np.broadcast_to(covariances, (count, size, size)))
    known = made[np.isfinite(made).all(axis=(1, 2))]
    values = np.linalg.eigvalsh(known) if len(known) else np.zeros((1, size))
    if (values[:, 0] < -1e-6 * values[:, -1]).any():
        raise CalibrationError('a covariance of the observations is not positive semidefinite')
    # Drivers write zero for unknown variances; no sensor is that precise.
    return None if (np.einsum('nii->ni', known) <= 0.0).any() else made
