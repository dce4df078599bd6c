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

"""Uncertainty: a degree of mounting error at five metres, and which edge an error comes from."""

from collections.abc import Sequence
from functools import partial
from math import radians, sqrt
from typing import Any, NamedTuple

import numpy as np
from tf_tree_py.core import BufferCore, LATEST, Pose
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.geometry.so3 import Array

from .pictures import GREY, STYLES
from .report import Column, Report, Table

SUMMARY = 'one degree of mounting error is 9 cm at 5 m; which edge an error comes from'

ANGLE, SHIFT = radians(1.0), 0.01
DISTANCES = (0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
_DRAWS = 20_000

# Deviations of x, y, z in metres and of rotation about x, y, z in degrees: a good indoor
# localisation, odometry since then, a joint with play, and a camera that was screwed on.
EDGES: tuple[tuple[str, str, Pose, tuple[float, ...]], ...] = (
    ('map', 'odom', Pose.from_xyz_rpy(x=4.0, yaw=0.3), (0.03, 0.03, 0.0, 0.0, 0.0, 0.5)),
    ('odom', 'base_link', Pose.from_xyz_rpy(x=2.0, yaw=0.5), (0.01, 0.01, 0.0, 0.0, 0.0, 0.3)),
    ('base_link', 'head', Pose(z=1.1), (0.001, 0.001, 0.001, 0.0, 0.1, 0.2)),
    ('head', 'camera', Pose(x=0.1), (0.005, 0.005, 0.005, 1.0, 1.0, 1.0)),
)


class Spread(NamedTuple):
    """How far off a thing is that a camera sees ahead; standard deviations, metres."""

    distance: float
    by_angle: float
    by_shift: float
    drawn: float
    """That by the angle, as draws of the mounting have it."""


def covariance_of(deviations: Sequence[float]) -> Array:
    """Return a covariance of independent errors: metres, and degrees."""
    return np.diag(np.square([*deviations[:3], *np.radians(deviations[3:])]))


def seen_at(distance: float, mounting: Array) -> BufferCore:
    """Return a camera that sees a thing ahead, mounted with an uncertainty."""
    buffer = BufferCore()
    buffer.insert('base', 'camera', LATEST, Pose(z=0.5), static=True, covariance=mounting)
    buffer.insert('camera', 'thing', LATEST, Pose(x=distance), static=True)
    return buffer


def spread(distance: float) -> Spread:
    """Return how far off a thing is sideways for a degree, and for a centimetre, of mounting."""
    turned, shifted = (
        seen_at(distance, np.diag(variances)).lookup_uncertain('base', 'thing')[1]
        for variances in ([0.0] * 3 + [ANGLE ** 2] * 3, [SHIFT ** 2] * 3 + [0.0] * 3))
    draws = np.random.default_rng(1).normal(scale=ANGLE, size=(_DRAWS, 3))
    drawn = so3.rotate_many(so3.exp_many(draws), np.array([distance, 0.0, 0.0]))
    return Spread(distance, sqrt(turned[1, 1]), sqrt(shifted[1, 1]), float(drawn[:, 1].std()))


def robot(distance: float = 5.0) -> BufferCore:
    """Return a robot whose every edge is a little uncertain, and a thing ahead of it."""
    buffer = BufferCore()
    for parent, child, pose, deviations in EDGES:
        buffer.insert(parent, child, LATEST, pose, static=True,
                      covariance=covariance_of(deviations))
    buffer.insert('camera', 'thing', LATEST, Pose(x=distance), static=True)
    return buffer


def run() -> Report:
    """Ask for the uncertainty of a thing ahead of a camera, and for where it comes from."""
    spreads = [spread(distance) for distance in DISTANCES]
    at_five = spreads[DISTANCES.index(5.0)]
    first = robot().lookup_budget('map', 'thing')[0]
    return Report(
        tables=[_distance_table(spreads), _budget_table(), _frames_table()],
        law='an error of an angle grows with the distance, sigma = d theta, and one of a place '
            f'does not: 1 deg of mounting is {at_five.by_angle * 100.0:.1f} cm at 5 m, 1 cm '
            f'remains 1 cm, and they are equal at {SHIFT / ANGLE:.2f} m. Independent edges add '
            'their variances, so the greatest one decides: here '
            f'{first.parent} -> {first.child}, with {first.position * 100.0:.0f} % of it.',
        remarks=['Seen from the robot, what the map is unsure of drops out: an edge above the '
                 'meeting point of two frames is not walked.'],
        numbers={'by_angle_m': at_five.by_angle, 'by_shift_m': at_five.by_shift,
                 'equal_at_m': SHIFT / ANGLE, 'largest_share': first.position},
        draw=partial(_draw, spreads))


def _distance_table(spreads: list[Spread]) -> Table:
    return Table(
        'How far off sideways (1 sigma) is what a camera sees ahead',
        (Column('distance_m', 'distance [m]', '.2f'),
         Column('by_angle_m', '1 deg of mounting [cm]', '.2f', 100.0),
         Column('drawn_m', 'the same, 20,000 draws [cm]', '.2f', 100.0),
         Column('by_shift_m', '1 cm of mounting [cm]', '.2f', 100.0)),
        [(one.distance, one.by_angle, one.drawn, one.by_shift) for one in spreads])


def _budget_table() -> Table:
    rows = [(f'{share.parent} -> {share.child}', sqrt(np.trace(share.covariance[:3, :3])),
             share.position, share.rotation)
            for share in robot().lookup_budget('map', 'thing')]
    return Table(
        'Where the error of a thing in the map comes from, 5 m ahead of the camera',
        (Column('edge', 'edge'), Column('sigma_m', 'adds [cm]', '.2f', 100.0),
         Column('position', 'of the position [%]', '.1f', 100.0),
         Column('rotation', 'of the rotation [%]', '.1f', 100.0)), rows)


def _frames_table() -> Table:
    buffer = robot()
    rows = []
    for target in ('map', 'odom', 'base_link', 'head', 'camera'):
        pose, covariance = buffer.lookup_uncertain(target, 'thing')
        rows.append((target, sqrt(np.trace(covariance[:3, :3]))))
    return Table('The same thing, as unsure as each frame is of it',
                 (Column('target', 'in'), Column('sigma_m', 'off by [cm]', '.2f', 100.0)), rows)


def _draw(spreads: list[Spread], figure: Any) -> None:
    left, right = figure.subplots(1, 2)
    distances = [one.distance for one in spreads]
    left.loglog(distances, [one.by_angle * 100.0 for one in spreads], **STYLES[0],
                label='1° of mounting')
    left.loglog(distances, [one.by_shift * 100.0 for one in spreads], **STYLES[1],
                label='1 cm of mounting')
    left.axvline(SHIFT / ANGLE, color=GREY, linewidth=1.0)
    left.annotate(f'{SHIFT / ANGLE:.2f} m', (SHIFT / ANGLE, 6.0), (4, 0),
                  textcoords='offset points', color=GREY)
    left.set(xlabel='distance [m]', ylabel='off by, sideways (1 σ) [cm]',
             title='An angle grows with the distance')
    left.set_xticks(distances, [f'{distance:g}' for distance in distances])
    left.minorticks_off()
    left.legend(loc='upper left')
    _draw_budget(right)


def _draw_budget(axes: Any) -> None:
    """Draw what each edge adds, and what they come to together."""
    buffer = robot()
    budget = buffer.lookup_budget('map', 'thing')
    names = [f'{share.parent} →\n{share.child}' for share in budget] + ['all together']
    covariances = [share.covariance for share in budget]
    sigmas = [100.0 * sqrt(np.trace(covariance[:3, :3]))
              for covariance in (*covariances, sum(covariances))]
    bars = axes.barh(names[::-1], sigmas[::-1], height=0.6, edgecolor='black', linewidth=0.8,
                     color=[GREY, *[STYLES[1]['color']] * len(budget)])
    axes.bar_label(bars, fmt='%.1f cm', padding=4)
    axes.set(xlabel='error of a thing 5 m ahead, in the map (1 σ) [cm]', xlim=(0.0, 19.0),
             title='Which edge it comes from')
    axes.grid(visible=False, axis='y')
