# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Uncertainty: a degree of mounting error at five metres, and which edge an error comes from."""

from collections.abc import Sequence
from functools import partial
from math import radians, sqrt
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array

from .report import Axes, Column, Figure, GREY, name_ticks, note, Report, STYLES, Table

SUMMARY = 'one degree of mounting error is 9 cm at 5 m; which edge an error comes from'

ANGLE, SHIFT = radians(1.0), 0.01
_DISTANCES = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
_DRAWS = 20_000

# Standard deviations of x, y, z in metres and of rotation about x, y, z in degrees: a good indoor
# localisation, odometry since then, a joint with play, and a camera mounted with screws.
EDGES: tuple[tuple[str, str, Pose, tuple[float, ...]], ...] = (
    ('map', 'odom', Pose.from_xyz_rpy(x=4.0, yaw=0.3), (0.03, 0.03, 0.0, 0.0, 0.0, 0.5)),
    ('odom', 'base_link', Pose.from_xyz_rpy(x=2.0, yaw=0.5), (0.01, 0.01, 0.0, 0.0, 0.0, 0.3)),
    ('base_link', 'head', Pose(z=1.1), (0.001, 0.001, 0.001, 0.0, 0.1, 0.2)),
    ('head', 'camera', Pose(x=0.1), (0.005, 0.005, 0.005, 1.0, 1.0, 1.0)),
)


class Spread(NamedTuple):
    """The uncertainty of an object ahead of a camera; standard deviations, metres."""

    distance: float
    by_angle: float
    by_shift: float
    drawn: float
    """The deviation by the angle, from random draws of the mounting."""


def covariance_of(deviations: Sequence[float]) -> Array:
    """Return a covariance of independent errors: metres, and degrees."""
    return np.diag(np.square([*deviations[:3], *np.radians(deviations[3:])]))


def seen_at(distance: float, mounting: Array) -> BufferCore:
    """Return a tree with a camera of uncertain mounting and an object ahead of it."""
    buffer = BufferCore()
    buffer.insert('base', 'camera', LATEST, Pose(z=0.5), static=True, covariance=mounting)
    buffer.insert('camera', 'thing', LATEST, Pose(x=distance), static=True)
    return buffer


def spread(distance: float) -> Spread:
    """Return the lateral deviation for a degree, and for a centimetre, of mounting error."""
    turned, shifted = (
        seen_at(distance, np.diag(variances)).lookup_uncertain('base', 'thing')[1]
        for variances in ([0.0] * 3 + [ANGLE ** 2] * 3, [SHIFT ** 2] * 3 + [0.0] * 3))
    draws = np.random.default_rng(1).normal(scale=ANGLE, size=(_DRAWS, 3))
    drawn = so3.rotate_many(so3.exp_many(draws), np.array([distance, 0.0, 0.0]))
    return Spread(distance, sqrt(turned[1, 1]), sqrt(shifted[1, 1]), float(drawn[:, 1].std()))


def robot(distance: float = 5.0) -> BufferCore:
    """Return a robot whose edges are all slightly uncertain, and an object ahead of it."""
    buffer = BufferCore()
    for parent, child, pose, deviations in EDGES:
        buffer.insert(parent, child, LATEST, pose, static=True,
                      covariance=covariance_of(deviations))
    buffer.insert('camera', 'thing', LATEST, Pose(x=distance), static=True)
    return buffer


def run() -> Report:
    """Look up the uncertainty of an object ahead of a camera, and the edges that cause it."""
    spreads = [spread(distance) for distance in _DISTANCES]
    at_five = spreads[_DISTANCES.index(5.0)]
    first = robot().lookup_budget('map', 'thing')[0]
    return Report(
        tables=[_distance_table(spreads), _budget_table(), _frames_table()],
        law='an angular error grows with the distance, sigma = d theta, and an error of position '
            f'does not: 1 deg of mounting is {at_five.by_angle * 100.0:.1f} cm at 5 m, 1 cm '
            f'remains 1 cm, and they are equal at {SHIFT / ANGLE:.2f} m. Independent edges add '
            'their variances, so the largest one dominates: here '
            f'{first.parent} -> {first.child}, with {first.position * 100.0:.0f} % of it.',
        remarks=["In the robot's frame the uncertainty of the localisation vanishes, because "
                 'edges above the common ancestor of two frames are not on their path.'],
        numbers={'by_angle_m': at_five.by_angle, 'by_shift_m': at_five.by_shift,
                 'equal_at_m': SHIFT / ANGLE, 'largest_share': first.position},
        draw=partial(_draw, spreads))


def _distance_table(spreads: list[Spread]) -> Table:
    return Table(
        'The lateral deviation (1 sigma) of an object ahead of a camera',
        (Column('distance_m', 'distance [m]', '.2f'),
         Column('by_angle_m', '1 deg of mounting [cm]', '.2f'),
         Column('drawn_m', 'the same, 20,000 draws [cm]', '.2f'),
         Column('by_shift_m', '1 cm of mounting [cm]', '.2f')),
        [(one.distance, one.by_angle, one.drawn, one.by_shift) for one in spreads])


def _budget_table() -> Table:
    rows = [(f'{share.parent} -> {share.child}', sqrt(np.trace(share.covariance[:3, :3])),
             share.position, share.rotation)
            for share in robot().lookup_budget('map', 'thing')]
    return Table(
        'The sources of the error in the map of an object 5 m ahead of the camera',
        (Column('edge', 'edge'), Column('sigma_m', 'adds [cm]', '.2f'),
         Column('position', 'of the position [%]', '.1f'),
         Column('rotation', 'of the rotation [%]', '.1f')), rows)


def _frames_table() -> Table:
    buffer = robot()
    rows = []
    for target in ('map', 'odom', 'base_link', 'head', 'camera'):
        pose, covariance = buffer.lookup_uncertain(target, 'thing')
        rows.append((target, sqrt(np.trace(covariance[:3, :3]))))
    return Table('The uncertainty of the same object in each frame',
                 (Column('target', 'in'), Column('sigma_m', 'off by [cm]', '.2f')), rows)


def _draw(spreads: list[Spread], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    distances = [one.distance for one in spreads]
    left.loglog(distances, [one.by_angle * 100.0 for one in spreads], **STYLES[0],
                label='mounting 1° off')
    left.loglog(distances, [one.by_shift * 100.0 for one in spreads], **STYLES[1],
                label='mounting 1 cm off')
    left.axvline(SHIFT / ANGLE, color=GREY, linewidth=1.0)
    note(left, f'equal at {SHIFT / ANGLE:.2f} m', (SHIFT / ANGLE, 6.0), (4, 0), color=GREY)
    left.set(xlabel='distance [m]', ylabel='sideways error (1 σ) [cm]',
             title='An angle grows with the distance')
    name_ticks(left, distances)
    _draw_budget(right)


def _draw_budget(axes: Axes) -> None:
    """Draw the contribution of each edge, and the total."""
    buffer = robot()
    budget = buffer.lookup_budget('map', 'thing')
    names = [f'{share.parent} →\n{share.child}' for share in budget] + ['all together']
    covariances = [share.covariance for share in budget]
    sigmas = [100.0 * sqrt(np.trace(covariance[:3, :3]))
              for covariance in (*covariances, np.sum(covariances, axis=0))]
    bars = axes.barh(names[::-1], sigmas[::-1], height=0.6, edgecolor='black', linewidth=0.8,
                     color=[GREY, *[STYLES[1]['color']] * len(budget)])
    axes.bar_label(bars, fmt='%.1f cm', padding=4)
    axes.set(xlabel='error of a point 5 m ahead, in the map (1 σ) [cm]', xlim=(0.0, 19.0),
             title='Which edge the error comes from')
    axes.grid(visible=False, axis='y')
