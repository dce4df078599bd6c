# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A moving forklift misses its pallet, and the audit finds the faulty line of code."""

from collections.abc import Callable, Iterable
from functools import partial
from math import degrees, dist
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.reports.audit import LookupAudit
from tf_tree_py.screws import exp

from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = 'a forklift is right when it stands and wrong when it moves; whose line?'

SPEED = 0.5
TURN_RATE = 0.16
_PALLET_P = (2.5, 0.0, 0.0)
"""The pallet in base_link, ahead of the forklift, at the stamp of each image."""
DELAY = from_seconds(0.080)

_PERIOD = from_seconds(0.020)
_IMAGES = tuple(from_seconds(1.0) + number * from_seconds(0.173) for number in range(20))
_SCENES = {'standing': (0.0, 0.0), 'straight ahead': (SPEED, 0.0),
           'turning on the spot': (0.0, TURN_RATE), 'on a curve': (SPEED, TURN_RATE)}


class Forklift:
    """
    A forklift that publishes its pose at 50 Hz, and processes each image after a delay.

    :ivar buffer: the published transforms.
    :ivar audit: records the lookups of each line of code.
    """

    def __init__(self, speed: float, turn_rate: float) -> None:
        self._twist = (speed, 0.0, 0.0, 0.0, 0.0, turn_rate)
        self._sent = 0
        self.now = 0
        self.buffer = BufferCore()
        self.audit = LookupAudit(self.buffer, lambda: self.now)
        self.buffer.observers.add(self.audit)
        self.lookup = self.buffer.lookup

    def map_T_base(self, stamp: int) -> Pose:
        """Return its true pose, after driving at constant speeds since the stamp 0."""
        vx, vy, vz, wx, wy, wz = (as_seconds(stamp) * part for part in self._twist)
        return Pose._make(exp((vx, vy, vz, wx, wy, wz)))

    def drive_until(self, now: int) -> None:
        """Publish all poses up to a time."""
        self.now = now
        while self._sent + _PERIOD <= now:
            self._sent += _PERIOD
            self.buffer.insert('map', 'base_link', self._sent, self.map_T_base(self._sent))


# Three ways to process an image. Each has its own line, because the audit distinguishes lines.

def _when_it_is_processed(forklift: Forklift, _: int) -> Pose:
    processed = forklift.now
    # The data arrives during the lookup, which waits like one with a timeout.
    forklift.drive_until(processed + _PERIOD)
    return forklift.lookup('map', 'base_link', processed)


def _the_latest(forklift: Forklift, _: int) -> Pose:
    return forklift.lookup('map', 'base_link', LATEST)


def _when_it_was_taken(forklift: Forklift, image: int) -> Pose:
    # It also waits, if the image is processed at once.
    forklift.drive_until(max(forklift.now, image + _PERIOD))
    return forklift.lookup('map', 'base_link', image)


WAYS: dict[str, Callable[[Forklift, int], Pose]] = {
    'now': _when_it_is_processed, 'latest': _the_latest, "header's stamp": _when_it_was_taken}


class Miss(NamedTuple):
    """The error of the pallet's pose: ahead and to the left, metres; turned, radians."""

    scene: str
    way: str
    ahead: float
    left: float
    turned: float

    @property
    def size(self) -> float:
        """Return the distance between the true and the computed pallet, metres."""
        return dist((self.ahead, self.left), (0.0, 0.0))


def miss(scene: str, way: str, delay: int = DELAY) -> tuple[Miss, Forklift]:
    """Process 20 images, each after a delay; return the mean error, and the forklift."""
    speeds = _SCENES[scene]
    forklift = Forklift(*speeds)
    ahead_left_turned = []
    for image in _IMAGES:
        forklift.drive_until(image + delay)
        # The data has the stamp of the image, which the audit needs to compute the error.
        with forklift.audit.data_of(image):
            map_T_base = WAYS[way](forklift, image)
        off = forklift.map_T_base(image).inverse() @ map_T_base
        seen = off @ _PALLET_P - _PALLET_P
        ahead_left_turned.append((seen[0], seen[1], off.as_rotation_vector()[2]))
    return Miss(scene, way, *np.mean(ahead_left_turned, axis=0).tolist()), forklift


def run() -> Report:
    """Simulate a forklift that stands, drives and turns, and look up its pallet in three ways."""
    misses = [miss(scene, way)[0] for scene in _SCENES for way in WAYS]
    straight, turning, curve = (miss(scene, 'now')[0] for scene in list(_SCENES)[1:])
    stamped = max(row.size for row in misses if row.way == "header's stamp")
    both = straight.size + turning.size
    rate = dist((SPEED, TURN_RATE * _PALLET_P[0]), (0.0, 0.0))
    return Report(
        tables=[_table(misses), _audit_table()],
        law=f'{DELAY / 1e6:.0f} ms late the pallet is {straight.size * 100.0:.1f} cm off by '
            f'translation (v delay) and {turning.size * 100.0:.1f} cm by rotation (w r delay), '
            f'which are at right angles: {curve.size * 100.0:.1f} cm together; standing, '
            f"nothing; and with the header's stamp {stamped * 1e3:.1g} mm.",
        remarks=[
            f'Added as plain numbers the two make {both * 100.0:.1f} cm. They would if the pallet '
            'stood abreast of the forklift, on the outside of the curve; ahead of it they make '
            f'{curve.size * 100.0:.1f} cm. 8 cm take {0.08 / rate * 1e3:.0f} ms.',
            'The audit reports the motion of base_link in centimetres and degrees: at the pallet '
            f'{degrees(turning.turned):.2f} degrees are another {turning.size * 100.0:.1f} cm.'],
        numbers={'translation_m': straight.size, 'rotation_m': turning.size,
                 'together_m': curve.size, 'sum_m': both, 'stamped_m': stamped,
                 'delay_for_8cm_s': 0.08 / rate, 'turned_rad': curve.turned},
        draw=partial(_draw, straight, turning, curve))


def _table(misses: list[Miss]) -> Table:
    return Table(
        f'Where the pallet {_PALLET_P[0]} m ahead is placed, {DELAY / 1e6:.0f} ms after the image',
        (Column('scene', 'the forklift is'), Column('way', 'looked up with'),
         Column('off_m', 'off by [cm]', '.2f'), Column('ahead_m', 'ahead [cm]', '.2f'),
         Column('left_m', 'left [cm]', '.2f'), Column('turned_rad', 'turned [deg]', '.2f')),
        [(row.scene, row.way, row.size, row.ahead, row.left, row.turned) for row in misses])


def _audit_table() -> Table:
    """Return the audit's result for the line of code of each way, on the curve."""
    rows = []
    for way in WAYS:
        [line] = miss('on a curve', way)[1].audit.lines()
        rows.append((f'{line.caller.function}()', 'latest' if line.latest else 'a stamp',
                     line.lookups, line.behind_newest_s, line.behind_now_s, line.apart_s,
                     line.moved_m, line.turned_rad, line.meaning))
    return Table(
        'The lookup audit of the three lines of code, on the curve: base_link in map, with the '
        'known stamp of each image',
        (Column('line', 'line in'), Column('asked_for', 'asked for'), Column('lookups', 'times'),
         Column('behind_newest_s', 'behind newest [ms]', '.1f'),
         Column('behind_now_s', 'behind now [ms]', '.1f'), Column('apart_s', 'off by [ms]', '.1f'),
         Column('moved_m', 'moved at most [cm]', '.2f'),
         Column('turned_rad', 'turned [deg]', '.2f'), Column('meaning', '')), rows)


def _draw(straight: Miss, turning: Miss, curve: Miss, figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    _draw_triangle(left, straight, turning, curve)
    delays = np.linspace(0.0, 150.0, 7)
    standing = {'color': GREY, 'linewidth': 6.0, 'alpha': 0.4}
    for style, scene in zip((standing, *STYLES[2:], STYLES[1]), _SCENES, strict=True):
        right.plot(delays, _sizes_cm(scene, 'now', delays), **style, label=f'now; {scene}')
    right.plot(delays, _sizes_cm('on a curve', "header's stamp", delays), **STYLES[0],
               label="the header's stamp; on a curve")
    right.plot([DELAY / 1e6] * 2, [0.0, 8.4], color=GREY, linewidth=1.0)
    right.annotate(f'{DELAY / 1e6:.0f} ms', (DELAY / 1e6, 8.6), ha='center', color=GREY)
    right.set(xlabel='how late the lookup is [ms]', ylim=(-0.4, 14.5),
              ylabel='error of the pallet [cm]',
              title='Error of the pallet, by the time looked up')


def _sizes_cm(scene: str, way: str, delays: Iterable[float]) -> list[float]:
    return [miss(scene, way, from_seconds(delay / 1e3))[0].size * 100.0 for delay in delays]


def _draw_triangle(axes: Axes, straight: Miss, turning: Miss, curve: Miss) -> None:
    """Draw how translation and rotation add up, from above."""
    corner = (straight.ahead * 100.0, 0.0)
    tip = (curve.ahead * 100.0, curve.left * 100.0)
    for begin, end, style in (((0.0, 0.0), corner, STYLES[2]), (corner, tip, STYLES[3]),
                              ((0.0, 0.0), tip, STYLES[1])):
        axes.annotate('', end, begin, arrowprops={
            'arrowstyle': '-|>', 'color': style['color'], 'linewidth': 1.8,
            'linestyle': style['linestyle'], 'shrinkA': 0.0, 'shrinkB': 0.0})
    axes.plot(0.0, 0.0, marker='s', color='black', markersize=7)
    note(axes, 'the pallet', (0.0, 0.0), (-8, 8), ha='right')
    axes.annotate(f'translation: v · delay\n{straight.size * 100.0:.1f} cm', (2.0, -0.15),
                  ha='center', va='top', color=STYLES[2]['color'])
    axes.annotate(f'rotation:\nω r · delay\n{turning.size * 100.0:.1f} cm', (4.15, 1.4),
                  color=STYLES[3]['color'])
    axes.annotate(f'together\n{curve.size * 100.0:.1f} cm', (1.9, 1.9), ha='right',
                  color=STYLES[1]['color'])
    axes.plot(*tip, marker='s', color='black', markersize=7, fillstyle='none')
    note(axes, 'where it is placed', tip, (-10, 8), ha='center')
    axes.set(xlabel='ahead [cm]', ylabel='to the left [cm]', aspect='equal', xlim=(-1.9, 6.1),
             ylim=(-1.4, 4.4), title=f'{DELAY / 1e6:.0f} ms late, on a curve, from above')
