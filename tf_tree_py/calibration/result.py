# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The result of a calibration, as data."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, NamedTuple

from tf_tree_py.core import Pose

from .observability import Unobservable
from .observations import Array
from .verdict import Explanation, Verdict


class EdgeEstimate(NamedTuple):
    """
    An edge before and after.

    :ivar before: ``parent_T_child`` in the tree.
    :ivar after: ``parent_T_child`` by the estimate.
    :ivar covariance: (6, 6) of ``after``, in the convention of ``PoseWithCovariance`` and
        ``insert``.
    """

    parent: str
    child: str
    before: Pose
    after: Pose
    covariance: Array

    @property
    def moved_m(self) -> float:
        """Return the distance between the two origins of the child, metres."""
        return math.dist(self.before[:3], self.after[:3])

    @property
    def turned_rad(self) -> float:
        """Return the angle between the two rotations of the child."""
        turn = (self.before.inverse() @ self.after).as_rotation_vector()
        return math.hypot(*turn)


class TimeOffset(NamedTuple):
    """
    The time offset of a sensor in seconds: positive if its stamps are later than the truth.

    :ivar sigma_s: the standard deviation of the offset.
    :ivar at_bound: whether the offset is the largest that was tried: the true one may be larger.
    :ivar jitter_s: the standard deviation of single stamps about the offset; 0 if none is visible.
    """

    sensor: str
    offset_s: float
    sigma_s: float
    at_bound: bool = False
    jitter_s: float = 0.0


class Outlier(NamedTuple):
    """
    An observation that contradicts the others.

    :ivar sigmas: its distance from the estimate, in standard deviations.
    """

    stamp: int
    sensor: str
    target: str
    sigmas: float


class Trace(NamedTuple):
    """
    The errors of the observations before and after, in order of time.

    :ivar stamps: (N,) nanoseconds.
    :ivar speed: (N,) of the target past the sensor, metres a second.
    :ivar before_m: (N,) errors with the edges of the tree and without a time offset, metres.
    :ivar after_m: (N,) errors with the estimate, metres.
    """

    stamps: Array
    speed: Array
    before_m: Array
    after_m: Array


@dataclass(frozen=True)
class Calibration:
    """
    The result of ``calibrate``.

    :ivar edges: the edges, in the order of the arguments.
    :ivar time_offsets: one for each sensor; empty without ``time``.
    :ivar verdict: what is wrong.
    :ivar explanations: all four, with the errors that each leaves unexplained.
    :ivar unobservable: the directions that the observations do not show; these keep the value
        of the tree.
    :ivar outliers: the outliers, by stamp.
    :ivar observations: how many observations were used.
    :ivar places: ``fixed_in_T_target`` of each estimated target, by (fixed_in, name).
    :ivar correlation_time: how many successive observations carry as much information as one.
    :ivar covariance: (Q, Q) of all edges and then all offsets together.
    :ivar trace: the errors of the observations, for pictures.
    """

    edges: Sequence[EdgeEstimate]
    time_offsets: Sequence[TimeOffset]
    verdict: Verdict
    explanations: Sequence[Explanation]
    unobservable: Sequence[Unobservable]
    outliers: Sequence[Outlier]
    observations: int
    places: dict[tuple[str, str], Pose]
    correlation_time: float
    covariance: Array
    trace: Trace

    @property
    def edge(self) -> EdgeEstimate:
        """Return the first edge."""
        return self.edges[0]

    @property
    def time_offset_s(self) -> float | None:
        """Return the offset of the first sensor; None without ``time``."""
        return self.time_offsets[0].offset_s if self.time_offsets else None

    @property
    def time_offset_sigma_s(self) -> float | None:
        """Return the standard deviation of ``time_offset_s``."""
        return self.time_offsets[0].sigma_s if self.time_offsets else None

    @property
    def all_at_one_place(self) -> bool:
        """Return whether no direction of any edge, and no time offset, is observable."""
        sensors = len(self.explanations[0].offsets)
        return len(self.unobservable) >= 6 * len(self.edges) + sensors

    @property
    def wants_new_edge(self) -> bool:
        """Return whether an edge is wrong by the verdict."""
        return self.verdict in (Verdict.EDGE, Verdict.BOTH)

    def as_dict(self) -> dict[str, Any]:
        """Return the result as plain data for JSON."""
        edges = [_plain_edge(each) for each in self.edges]
        return {
            'verdict': self.verdict.value,
            'edge': edges[0],
            'edges': edges,
            'time_offset_s': self.time_offset_s,
            'time_offset_sigma_s': self.time_offset_sigma_s,
            'time_offsets': [each._asdict() for each in self.time_offsets],
            'explanations': [_plain_explanation(each) for each in self.explanations],
            'unobservable': [each._asdict() | {'axis': list(each.axis)}
                             for each in self.unobservable],
            'outliers': [{'stamp_ns': each.stamp, 'sensor': each.sensor, 'target': each.target,
                          'sigmas': each.sigmas} for each in self.outliers],
            'observations': self.observations,
            'correlation_time': self.correlation_time,
            'targets': [{'fixed_in': fixed_in, 'target': target, 'place': _numbers(place)}
                        for (fixed_in, target), place in self.places.items()],
        }


def _plain_edge(edge: EdgeEstimate) -> dict[str, Any]:
    return {'parent': edge.parent, 'child': edge.child, 'before': _numbers(edge.before),
            'after': _numbers(edge.after), 'covariance': edge.covariance.tolist()}


def _plain_explanation(each: Explanation) -> dict[str, Any]:
    return {'name': each.name.value, 'criterion': each.criterion, 'misfit': each.misfit,
            'free': each.free,
            'unexplained_m': each.unexplained_m,
            'unexplained_rad': None if math.isnan(each.unexplained_rad)
            else each.unexplained_rad,
            'time_offset_s': each.offsets[0]}


def _numbers(pose: Pose) -> dict[str, float]:
    return dict(zip(('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw'), map(float, pose), strict=True))
