# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A localiser that sees the robot in the map: late, out of order, twice, and sometimes wrong.

Each sighting states the covariance that its error is drawn from; an outlier states one, too.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from .robot import Array, FINE_HZ, IN_PLANE, Motion, one

DELAYS_S = (0.05, 0.3)
OUTLIERS, TWICE = 0.05, 0.1
# The usual standard deviations, metres and radians, and the spread of their logarithms.
_SIGMA, _SPREAD = np.array([0.03] * 3 + [0.015] * 3), 0.3
# How far away outliers are.
_AWAY_M, _AWAY_RAD = (0.5, 6.0), (0.2, 3.0)
_AWAY_TOGETHER_M = (1.0, 3.0)


class Burst(NamedTuple):
    """
    A while in which outliers agree with each other, because they see one wrong part of the map.

    :ivar share: the part of the sightings that are such outliers.
    """

    begin: float
    end: float
    share: float


class Seen(NamedTuple):
    """
    One delivery of a sighting.

    :ivar arrival: nanoseconds.
    :ivar stamp: nanoseconds.
    :ivar pose: (7,) of map_T_base.
    :ivar covariance: (6, 6) as in ``PoseWithCovariance``.
    :ivar good: whether it is no outlier.
    :ivar first: whether it is the first delivery.
    """

    arrival: int
    stamp: int
    pose: tuple[float, ...]
    covariance: Array
    good: bool
    first: bool


def sightings(rng: np.random.Generator, fine: Motion, rate_hz: float, planar: bool,
              outage: tuple[float, float] = (0.0, 0.0), bursts: tuple[Burst, ...] = (),
              ) -> list[Seen]:
    """Return all deliveries, in their order."""
    seconds = (len(fine.positions) - 1) / FINE_HZ
    found = []
    wrong = [(fine.positions[round(burst.begin * FINE_HZ)], _away(rng, planar, _AWAY_TOGETHER_M))
             for burst in bursts]
    for number in range(int(rate_hz * seconds)):
        at = round((number + 0.5) / rate_hz * FINE_HZ)  # a stamp of which the truth is known
        when = at / FINE_HZ
        pose, covariance = _noisy(rng, fine[at], planar)
        away = (pose.positions, _away(rng, planar, _AWAY_M)) if rng.random() < OUTLIERS else None
        for burst, place in zip(bursts, wrong, strict=True):
            if burst.begin <= when < burst.end and rng.random() < burst.share:
                away = place
        if away is not None:
            pose = _elsewhere(pose, *away)
        arrivals = when + np.cumsum(rng.uniform(*DELAYS_S, 2))
        if outage[0] <= when < outage[1]:
            continue
        for late in arrivals[:1 + (rng.random() < TWICE)]:
            found.append(Seen(round(late * 1e9), round(when * 1e9), tuple(pose.rows().tolist()),
                              covariance, away is None, late == arrivals[0]))
    return sorted(found, key=lambda seen: seen.arrival)


def _noisy(rng: np.random.Generator, truth: Motion, planar: bool) -> tuple[Motion, Array]:
    """Return a pose with an error, and the covariance of the error."""
    axes, _ = np.linalg.qr(rng.normal(size=(6, 6)))
    root = _SIGMA[:, None] * axes * np.exp(_SPREAD * rng.normal(size=6))
    if planar:  # it says nothing of the rest, as AMCL does
        root = root * IN_PLANE[:, None]
    error = root @ rng.normal(size=6)
    return Motion(truth.positions + error[:3],
                  Rotation.from_rotvec(error[3:]) * truth.rotations), root @ root.T


def _elsewhere(pose: Motion, centre: Array, away: Motion) -> Motion:
    """Return a pose after a turn of the map about a centre, and a shift."""
    return Motion(centre + away.positions + away.rotations.apply(pose.positions - centre),
                  away.rotations * pose.rotations)


def _away(rng: np.random.Generator, planar: bool, metres: tuple[float, float]) -> Motion:
    """Return how far an outlier is away."""
    flat = IN_PLANE if planar else np.ones(6)
    shift, axis = rng.normal(size=3) * flat[:3], rng.normal(size=3) * flat[3:]
    return one(rng.uniform(*metres) * shift / np.linalg.norm(shift),
               rng.uniform(*_AWAY_RAD) * axis / np.linalg.norm(axis))
