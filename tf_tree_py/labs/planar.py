# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A planar pose on uneven ground: the error of three numbers instead of six.

``project`` converts a pose in space to a planar one (x, y, yaw), in metres and radians, yaw about
z. It also returns the residual that a planar pose omits: the error of a planar tree.
"""

from functools import partial
import math
from math import degrees, hypot, radians, sin
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import from_seconds

from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

_PlanarTuple = tuple[float, float, float]


class Residual(NamedTuple):
    """
    The part of a pose in space that a planar pose omits.

    A point at height h above the origin is misplaced on the floor by h sin(tilt): 2.6 cm for
    h = 0.3 m at 5 degrees.
    """

    z: float
    """Height of the origin above the plane, metres."""
    tilt: float
    """Angle between the two z axes, radians, 0 to pi."""


def lift(planar: _PlanarTuple) -> PoseTuple:
    """Return the pose in space of a planar pose, at height 0."""
    x, y, yaw = planar
    return (x, y, 0.0, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def project(pose: PoseTuple) -> tuple[_PlanarTuple, Residual]:
    """
    Return the planar part of a pose in space, and what is lost; the yaw lies in (-pi, pi].

    The rotation is split into tilt * yaw about z (swing and twist). This yaw is the nearest to
    the full rotation. If the tilt is pi, no yaw is defined, and 0 is returned.
    """
    x, y, z, qx, qy, qz, qw = pose
    yaw = 2.0 * math.atan2(qz, qw) if qz or qw else 0.0
    tilt = 2.0 * math.atan2(math.hypot(qx, qy), math.hypot(qz, qw))
    return (x, y, _wrap(yaw)), Residual(z, tilt)


def _wrap(angle: float) -> float:
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


# --- the lab

SUMMARY = 'on a slope a planar tree misplaces a thing at height h by h sin(tilt)'

_TILTS_DEG = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
_HEIGHTS = (0.3, 1.0, 2.0)

_STAMP = from_seconds(1.0)
# The pose of the robot; the law does not depend on it.
_X, _Y, _YAW = 2.0, 1.0, 0.6


class Floor(NamedTuple):
    """The error on the floor, metres, of a point above a base that is tilted, radians."""

    tilt: float
    height: float
    by_roll: float
    by_pitch: float
    residual_tilt: float
    """The tilt in the residual of ``project``, radians."""


def standing(roll: float, pitch: float) -> BufferCore:
    """Return a tree whose base is tilted, radians."""
    buffer = BufferCore()
    buffer.insert('map', 'base_link', _STAMP, Pose.from_xyz_rpy(_X, _Y, 0.0, roll, pitch, _YAW))
    return buffer


def _flattened(map_T_base: Pose) -> Pose:
    """Return the pose in space that remains if a planar tree stores it."""
    planar, _ = project(map_T_base)
    return Pose._make(lift(planar))


def on_the_floor(tilt: float, height: float) -> Floor:
    """Transform a point straight above the base, with all six numbers and with three."""
    errors = []
    for roll, pitch in ((tilt, 0.0), (0.0, tilt)):
        map_T_base = standing(roll, pitch).lookup('map', 'base_link', LATEST)
        true, flat = (pose @ (0.0, 0.0, height) for pose in (map_T_base, _flattened(map_T_base)))
        errors.append(hypot(*(true - flat)[:2]))
    return Floor(tilt, height, errors[0], errors[1], project(map_T_base)[1].tilt)


def everywhere(pitch: float) -> list[tuple[str, float, float]]:
    """Return points ahead of, beside and above the base, with errors along the floor and up."""
    map_T_base = standing(0.0, pitch).lookup('map', 'base_link', LATEST)
    points = []
    for base_p in ((2.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 2.0), (2.0, 0.0, 1.0)):
        off = map_T_base @ base_p - _flattened(map_T_base) @ base_p
        points.append((str(base_p), hypot(*off[:2]), abs(float(off[2]))))
    return points


def fit(rows: list[Floor]) -> float:
    """Return k of error = k h sin(tilt): least squares through zero."""
    law = np.array([row.height * sin(row.tilt) for row in rows])
    return float(law @ [row.by_pitch for row in rows] / (law @ law))


def run() -> Report:
    """Tilt the robot about both axes, and look up points above it."""
    rows = [on_the_floor(radians(tilt), height) for height in _HEIGHTS for tilt in _TILTS_DEG]
    slope = fit(rows)
    low, high = (on_the_floor(radians(5.0), height).by_pitch for height in _HEIGHTS[:2])
    bumpy = project(standing(radians(3.0), radians(4.0)).lookup('map', 'base_link'))[1]
    return Report(
        tables=[_floor_table(rows), _point_table(everywhere(radians(5.0)))],
        law=f'an object at height h above a base tilted by an angle is misplaced on the floor '
            f'by {slope:.4f} h sin(angle): at 5 degrees {low * 100.0:.1f} cm for h = 0.3 m and '
            f'{high * 100.0:.1f} cm for h = 1 m.',
        remarks=[
            'The three numbers do not show this error. The project function of this lab '
            'returns the height and the tilt that it drops, with the planar pose. For a base at '
            f'roll 3 and pitch 4 degrees it returns z = {bumpy.z:.3f} m and '
            f'tilt = {bumpy.tilt:.4f} rad, which is {degrees(bumpy.tilt):.3f} degrees: the two '
            'angles add up nearly as the legs of a right-angled triangle (5.000).'],
        numbers={'slope': slope, 'error_0.3m_5deg_m': low, 'error_1m_5deg_m': high,
                 'tilt_of_roll_3_pitch_4_rad': bumpy.tilt},
        draw=partial(_draw, rows))


def _floor_table(rows: list[Floor]) -> Table:
    return Table(
        'The error of a planar tree along the floor, for an object straight above the base',
        (Column('height_m', 'h [m]', '.1f'), Column('tilt_rad', 'lean [deg]', '.0f'),
         Column('roll_error_m', 'off by roll [cm]', '.2f'),
         Column('pitch_error_m', 'off by pitch [cm]', '.2f'),
         Column('law_m', 'h sin(lean) [cm]', '.2f'),
         Column('residual_tilt_rad', 'reported residual tilt [deg]', '.3f')),
        [(row.height, row.tilt, row.by_roll, row.by_pitch, row.height * sin(row.tilt),
          row.residual_tilt) for row in rows])


def _point_table(points: list[tuple[str, float, float]]) -> Table:
    return Table(
        'The effect of the projection on points of the base at a pitch of 5 degrees',
        (Column('base_p_m', 'point in base_link [m]'),
         Column('floor_m', 'off along the floor [cm]', '.2f'),
         Column('up_m', 'off in height [cm]', '.2f')), points)


def _draw(rows: list[Floor], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    for style, height in zip(STYLES, _HEIGHTS, strict=False):
        line = [row for row in rows if row.height == height]
        left.plot([degrees(row.tilt) for row in line], [row.by_pitch * 100.0 for row in line],
                  **style, label=f'h = {height:g} m')
    left.set(xlabel='lean of the base [°]', ylabel='error along the floor [cm]',
             title='error = h · sin(lean)')
    _draw_side(right)


def _draw_side(axes: Axes) -> None:
    """Draw a robot on a slope from the side; the tilt is exaggerated."""
    lean, height = radians(20.0), 1.0
    foot, top = (0.9, 0.0), (0.9 + height * sin(lean), height * np.cos(lean))
    axes.plot([foot[0], top[0]], [foot[1], top[1]], color='black', linewidth=2.0)
    axes.plot([foot[0], foot[0]], [0.0, height], color=GREY, linestyle='--')
    axes.plot(*top, marker='o', color='black', markersize=8)
    axes.plot(foot[0], height, marker='o', color=GREY, markersize=8, fillstyle='none')
    note(axes, 'where it is', top, (10, -12))
    note(axes, 'where a planar\ntree puts it', (foot[0], height), (-8, 10), ha='right')
    axes.annotate('', (top[0], 0.1), (foot[0], 0.1), arrowprops={'arrowstyle': '<->'})
    axes.plot([top[0], top[0]], [0.0, top[1]], color=GREY, linewidth=0.8, linestyle=':')
    note(axes, 'h sin(lean)', (top[0], 0.1), (8, -3))
    axes.annotate('h', (foot[0] + 0.1, 0.55))
    axes.plot([0.0, 2.1], [0.0, 0.0], color='black', linewidth=0.8)
    slope = np.array([0.0, 1.8])
    axes.plot(slope, (foot[0] - slope) * np.tan(lean), color='black')
    axes.set(xlabel='forward [m]', ylabel='up [m]', aspect='equal',
             xlim=(0.0, 2.1), ylim=(-0.4, 1.5), title='From the side (drawn with 20°)')
