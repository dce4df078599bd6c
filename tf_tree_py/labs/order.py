# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Composition does not commute: the worked example, its exercise, and the wrong order."""

from collections.abc import Iterable
from functools import partial, reduce
from math import pi
from operator import matmul
from typing import Any

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose

from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = 'first turn, then go is not first go, then turn; what hides it'

FRAMES = ('map', 'odom', 'base_link', 'camera')
CAMERA_P = (1.0, 0.0, 0.0)
_FORWARD = (1.0, 0.0, 0.0)
LEFT_TURN = Pose.from_xyz_rpy(yaw=pi / 2)

# The textbook's example, and its exercise: the same with a robot that faces left.
EXAMPLE = (Pose(2.0, 0.0, 0.0), Pose(0.5, 1.0, 0.0), Pose(0.2, 0.0, 0.8))
EXERCISE = (EXAMPLE[0], EXAMPLE[1] @ LEFT_TURN, EXAMPLE[2])

Chain = tuple[Pose, ...]


def tree(chain: Chain) -> BufferCore:
    """Return map -> odom -> base_link -> camera with these edges."""
    buffer = BufferCore()
    for parent, child, pose in zip(FRAMES, FRAMES[1:], chain, strict=False):
        buffer.insert(parent, child, LATEST, pose, static=True)
    return buffer


def _wrong_order(chain: Chain) -> Pose:
    """Return the product of the edges in the wrong order."""
    return reduce(matmul, reversed(chain))


def placed(map_T_frame: Pose) -> tuple[str, str]:
    """Return the position of a frame, and the direction of its x axis, as text."""
    origin = map_T_frame @ (0.0, 0.0, 0.0)
    return str(_rounded(origin)), str(_rounded(map_T_frame @ _FORWARD - origin))


def point(chain: Chain) -> tuple[float, ...]:
    """Return the camera's point in the map."""
    return _rounded(tree(chain).lookup('map', 'camera') @ CAMERA_P)


def _rounded(vector: Iterable[float]) -> tuple[float, ...]:
    """Return a vector that is rounded for reading: 1e-9 m becomes 0, and -0.0 becomes 0.0."""
    return tuple(round(float(number), 9) + 0.0 for number in vector)


def symptoms() -> list[tuple[str, ...]]:
    """
    Turn each edge of the example by 90 degrees to the left, one at a time.

    :return: the edge, and what follows, in the axes of the first frame: where the base faces in
        odom and in the map, where the camera faces in the base, and where it is in the map.
    """
    rows = [_symptom('none', EXAMPLE)]
    for number in range(len(EXAMPLE)):
        chain = tuple(pose @ LEFT_TURN if number == i else pose for i, pose in enumerate(EXAMPLE))
        rows.append(_symptom(f'{FRAMES[number]} -> {FRAMES[number + 1]}', chain))
    return rows


def _symptom(edge: str, chain: Chain) -> tuple[str, ...]:
    lookup = tree(chain).lookup
    facing = [placed(lookup(target, source))[1] for target, source in (
        ('odom', 'base_link'), ('map', 'base_link'), ('base_link', 'camera'))]
    return (edge, *facing, placed(lookup('map', 'camera'))[0])


def run() -> Report:
    """Compose both ways, and walk through the example and the exercise."""
    go = Pose(1.0, 0.0, 0.0)
    both = [('turn @ go', 'turn, then go ahead', LEFT_TURN @ go),
            ('go @ turn', 'go ahead, then turn', go @ LEFT_TURN)]
    wrong = {name: _rounded(_wrong_order(chain) @ CAMERA_P)
             for name, chain in (('example', EXAMPLE), ('exercise', EXERCISE))}
    right = {'example': point(EXAMPLE), 'exercise': point(EXERCISE)}
    back = tree(EXERCISE).lookup('map', 'camera') @ tree(EXERCISE).lookup('camera', 'map')
    return Report(
        tables=[
            Table('One metre ahead and 90 degrees to the left, in either order',
                  (Column('product', 'product'), Column('words', 'in words'),
                   Column('origin_m', 'ends at [m]'), Column('forward', 'faces')),
                  [(product, words, *placed(pose)) for product, words, pose in both]),
            _steps_table('The example: no edge turns', EXAMPLE, right['example']),
            _steps_table('The exercise: odom -> base_link is yawed by 90 degrees', EXERCISE,
                         right['exercise']),
            _orders_table(right, wrong), _symptom_table(symptoms())],
        law='map_T_camera = map_T_odom odom_T_base base_T_camera, from the left to the right, '
            'and no other order: the wrong one gives the same for the example, which only '
            f'translates, and is {_apart(right["exercise"], wrong["exercise"]):.2f} m off for '
            'the exercise, which turns.',
        remarks=[f'map_T_camera camera_T_map of the exercise: {back}.'],
        numbers={'example': right['example'], 'exercise': right['exercise'],
                 'example_wrong': wrong['example'], 'exercise_wrong': wrong['exercise']},
        draw=partial(_draw, both))


def _apart(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return float(np.linalg.norm(np.subtract(a, b)))


def _steps_table(title: str, chain: Chain, seen: tuple[float, ...]) -> Table:
    buffer = tree(chain)
    rows = [(f'map_T_{frame}', *placed(buffer.lookup('map', frame))) for frame in FRAMES[1:]]
    return Table(
        f'{title}; the camera sees a point at {CAMERA_P}',
        (Column('product', 'partial product'), Column('origin_m', 'origin in map [m]'),
         Column('forward', 'its x axis in map')),
        [*rows, ('map_p', str(seen), '')])


def _orders_table(right: dict[str, tuple[float, ...]],
                  wrong: dict[str, tuple[float, ...]]) -> Table:
    return Table(
        'The point in the map, composed from the right end and from the wrong one',
        (Column('of', 'of'), Column('right_m', 'map_T_odom odom_T_base base_T_camera [m]'),
         Column('wrong_m', 'base_T_camera odom_T_base map_T_odom [m]'),
         Column('apart_m', 'apart [m]', '.3f')),
        [(name, str(right[name]), str(wrong[name]), _apart(right[name], wrong[name]))
         for name in right])


def _symptom_table(rows: list[tuple[str, ...]]) -> Table:
    return Table(
        'The symptom of a superfluous rotation by 90 degrees, on each edge: forward becomes left',
        (Column('edge', 'edge that is wrong'), Column('base_in_odom', 'base: ahead in odom'),
         Column('base_in_map', 'base: ahead in map'),
         Column('camera_in_base', 'camera: ahead in base'),
         Column('camera_origin_m', 'camera in map [m]')), rows)


def _draw(both: list[tuple[str, str, Pose]], figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    _frame(left, Pose(), 'start', GREY, 'dashed', (8, -14))
    for (product, words, pose), style, line, offset in zip(
            both, STYLES[1:], ('solid', 'dashdot'), ((10, 12), (10, 12)), strict=False):
        _frame(left, pose, f'{words}:\n{product}', style['color'], line, offset)
    left.set(xlabel='x [m]', ylabel='y [m]', aspect='equal', xlim=(-0.6, 2.4), ylim=(-0.5, 2.5),
             xticks=range(3), yticks=range(3), title='The same two motions, in either order')
    left.annotate('long arrow: x, ahead\nshort arrow: y, left', (2.3, 2.4), ha='right', va='top',
                  color=GREY)
    _draw_exercise(right)


def _draw_exercise(axes: Axes) -> None:
    buffer = tree(EXERCISE)
    offsets = {'map': (4, -14), 'odom': (4, -14), 'base_link': (10, -12), 'camera': (10, 6)}
    # Base and camera are only 0.2 m apart, so one is dashed and larger.
    for frame in FRAMES:
        colour, line, size = ('black', 'solid', 0.5) if frame != 'camera' else (
            STYLES[1]['color'], 'dashed', 0.75)
        _frame(axes, buffer.lookup('map', frame), frame, colour, line, offsets[frame], size)
    for where, marker, text, side in (
            (point(EXERCISE), 'o', 'the point', (9, -3)),
            (_rounded(_wrong_order(EXERCISE) @ CAMERA_P), 'X',
             'the same, composed\nfrom the wrong end', (9, -9))):
        axes.plot(*where[:2], marker=marker, color=STYLES[2]['color'], markersize=9)
        note(axes, text, where[:2], side)
    axes.set(xlabel='x in map [m]', ylabel='y in map [m]', aspect='equal', xticks=range(5),
             xlim=(-0.5, 4.5), ylim=(-0.5, 4.5), title='The exercise, from above')


def _frame(axes: Any, pose: Pose, text: str, colour: str, line: str,
           offset: tuple[float, float], size: float = 0.5) -> None:
    """Draw a frame from above: the long arrow is x, the short one y."""
    origin = (pose @ (0.0, 0.0, 0.0))[:2]
    for tip in (_FORWARD, (0.0, 0.6, 0.0)):
        axes.annotate('', origin + size * ((pose @ tip)[:2] - origin), origin, arrowprops={
            'arrowstyle': '->', 'color': colour, 'linestyle': line, 'linewidth': 1.6,
            'shrinkA': 0.0, 'shrinkB': 0.0})
    note(axes, text, origin, offset, color=colour)
