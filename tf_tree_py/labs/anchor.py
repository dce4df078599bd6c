# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A relocaliser that is late and sometimes wrong, and odometry that drifts."""

from collections.abc import Callable, Iterator
from functools import cache, partial
import math
from typing import NamedTuple

import numpy as np
from tf_tree_py import screws
from tf_tree_py.beyond.corrections.anchor import Anchor, Sighting
from tf_tree_py.beyond.corrections.blend import BlendLimits
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.core.times import Stamps

from .report import Axes, Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = '300 ms late: naive 9 m jumps, anchored 1.4 cm off and no jump'

LATE_S, RATE_HZ, OFTEN_HZ, OUTLIERS = 0.3, 2.0, 30.0, 0.01
SIGMA_M, SIGMA_RAD = 0.01, math.radians(0.3)
_DRIFT = 0.02
LIMITS = BlendLimits(from_seconds(0.3), 0.2, 0.1, 0.0)

STEP = from_seconds(0.02)
_DURATION_S = 240.0
_LOOP_S = 40.0
_SEED = 14
# Before this time the first sightings do not agree yet, or the blend to them has not ended.
_SETTLED = from_seconds(5.0)


class Pass(NamedTuple):
    """
    One run with one way to publish map -> odom.

    :ivar errors: (N,) the error of map -> base at each stamp, metres.
    :ivar steps: (N - 1,) how far map -> base moves from each stamp to the next, metres.
    """

    name: str
    errors: Array
    steps: Array


def driven(stamp: int) -> Pose:
    """Return map_T_base: a figure of eight, at up to 1.1 m/s."""
    phase = math.tau * as_seconds(stamp) / _LOOP_S
    x, y = 5.0 * math.sin(phase), 2.5 * math.sin(2.0 * phase)
    return Pose.from_xyz_rpy(x=x, y=y, yaw=math.atan2(2.0 * math.cos(2.0 * phase),
                                                      2.0 * math.cos(phase)))


@cache
def odometry(seconds: float) -> list[Pose]:
    """Return odom_T_base at the stamps: every motion and rotation is 2 % too long."""
    poses = [Pose()]
    truth = [driven(stamp) for stamp in _stamps_for(seconds).tolist()]
    for before, after in zip(truth[:-1], truth[1:], strict=True):
        twist = screws.log(before.inverse() @ after)
        x, y, z, rx, ry, rz = ((1.0 + _DRIFT) * part for part in twist)
        poses.append(poses[-1] @ Pose._make(screws.exp((x, y, z, rx, ry, rz))))
    return poses


def _stamps_for(seconds: float) -> Stamps:
    """Return the stamps of the odometry."""
    return np.arange(0, from_seconds(seconds) + 1, STEP)


def sightings(seconds: float, rate_hz: float = RATE_HZ) -> Iterator[tuple[int, Pose]]:
    """Yield the stamp of each image of the relocaliser, and its estimate of the pose."""
    rng = np.random.default_rng(_SEED)
    for stamp in range(0, from_seconds(seconds), from_seconds(1.0 / rate_hz)):
        x, y, yaw = rng.normal(0.0, (SIGMA_M, SIGMA_M, SIGMA_RAD)).tolist()
        truth = driven(stamp)
        # The errors follow the convention of the covariance: in the map's axes, about the robot.
        seen = Pose.from_parts(np.add(truth[:3], (x, y, 0.0)),
                               (Pose.from_xyz_rpy(yaw=yaw) @ truth)[3:])
        if rng.random() < OUTLIERS:
            x, y = rng.uniform(-5.0, 5.0, 2).tolist()
            seen = Pose.from_xyz_rpy(x, y, yaw=float(rng.uniform(-math.pi, math.pi)))
        yield stamp, seen


COVARIANCE = np.diag([SIGMA_M**2] * 2 + [1e-6] * 3 + [SIGMA_RAD**2])


class Held:
    """Publishes a pose of odom, at first the known one, which each pose of the robot replaces."""

    def __init__(self, name: str, placed: Callable[[Pose, Pose, Pose], Pose]) -> None:
        """
        Hold the known pose.

        :param placed: returns map_T_odom for the pose in an image, and the odometry at the time
            of the image and now.
        """
        self.name, self._placed = name, placed
        self._map_T_odom = driven(0)

    def update(self, stamp: int, seen: Pose, odom_T_then: Pose, odom_T_now: Pose) -> None:
        """Place odom by a pose that has arrived."""
        self._map_T_odom = self._placed(seen, odom_T_then, odom_T_now)

    def publish(self, stamp: int, odom_T_now: Pose) -> Pose:
        """Return map_T_odom."""
        return self._map_T_odom


class Anchored:
    """``tf_tree_py.beyond.corrections.anchor``."""

    name = 'relocalisation_anchor'

    def __init__(self) -> None:
        self.refused = 0
        self._anchor = Anchor(LIMITS)

    def update(self, stamp: int, seen: Pose, odom_T_then: Pose, odom_T_now: Pose) -> None:
        """Pass the pose to the anchor."""
        self.refused += not self._anchor.update(Sighting(
            stamp, seen, COVARIANCE, odom_T_then, np.zeros((6, 6)))).accepted

    def publish(self, stamp: int, odom_T_now: Pose) -> Pose:
        """Return map_T_odom."""
        return self._anchor.publish(stamp, odom_T_now) or driven(0)


def passed(way: Held | Anchored, rate_hz: float = RATE_HZ) -> Pass:
    """Simulate a robot with one way to publish map -> odom."""
    stamps = _stamps_for(_DURATION_S)
    odom_T_base = odometry(_DURATION_S)
    coming = sightings(_DURATION_S, rate_hz)
    seen_at, seen = next(coming)
    published = []
    for number, stamp in enumerate(stamps.tolist()):
        while seen_at + from_seconds(LATE_S) <= stamp:
            way.update(seen_at, seen, _between(odom_T_base, seen_at), odom_T_base[number])
            seen_at, seen = next(coming, (int(stamps[-1]) + 1, seen))
        here = odom_T_base[number]
        published.append(way.publish(stamp, here) @ here)
    return measured(way.name, stamps, np.array(published))


def _between(odom_T_base: list[Pose], stamp: int) -> Pose:
    """Return the odometry at a stamp, which may lie between two samples."""
    number, rest = divmod(stamp, STEP)
    after = odom_T_base[min(number + 1, len(odom_T_base) - 1)]
    return Pose._make(se3.interpolate(odom_T_base[number], after, rest / STEP))


def measured(name: str, stamps: Stamps, published: Array) -> Pass:
    """Return the errors of map_T_base (N, 7), and its steps from stamp to stamp."""
    truth = np.array([driven(stamp) for stamp in stamps.tolist()])
    return Pass(name, np.linalg.norm((published - truth)[:, :3], axis=1),
                np.linalg.norm(np.diff(published[:, :3], axis=0), axis=1))


def run() -> Report:
    """Drive for four minutes, and compare the published poses with the true ones."""
    anchored = Anchored()
    passes = [passed(way) for way in (
        Held('no anchor', lambda seen, then, now: driven(0)),
        Held('published when it comes', lambda seen, then, now: seen @ now.inverse()),
        Held('at its old stamp, ungated', lambda seen, then, now: seen @ then.inverse()),
        anchored)]
    often = passed(Anchored(), rate_hz=OFTEN_HZ)._replace(
        name=f'relocalisation_anchor, {OFTEN_HZ:g} Hz')
    first = int(np.searchsorted(_stamps_for(_DURATION_S), _SETTLED))
    naive, ours = passes[1], passes[3]
    own = float(passes[0].steps.max())
    return Report(
        tables=[_table([*passes, often], first)],
        law=f'a pose that is published on arrival is wrong by v 300 ms, '
            f'{100 * np.median(naive.errors[first:]):.0f} cm here, and jumps; with the anchor the '
            f'error is {100 * np.median(ours.errors[first:]):.1f} cm, and no step exceeds the '
            "robot's motion plus the stated rate.",
        remarks=[f'The anchor refused {anchored.refused} of {round(_DURATION_S * RATE_HZ)} poses, '
                 'including the first, which no other pose had confirmed.'],
        numbers={'often_m': float(np.median(often.errors[first:])),
                 'often_step_m': float(often.steps[first:].max()),
                 'anchored_m': float(np.median(ours.errors[first:])),
                 'naive_m': float(np.median(naive.errors[first:])),
                 'own_step_m': own, 'refused': anchored.refused},
        draw=partial(_draw, [*passes, often], first, own))


def _table(passes: list[Pass], first: int) -> Table:
    return Table(
        f'A robot at up to 1.1 m/s, odometry 2 % off, poses at {RATE_HZ:g} Hz that are '
        f'{LATE_S * 1e3:.0f} ms late and 1 cm off, one in a hundred wrong',
        (Column('name', 'map -> odom'), Column('median_m', 'off, median [cm]', '.1f'),
         Column('most_m', '95 % [cm]', '.1f'), Column('worst_m', 'worst [cm]', '.1f'),
         Column('step_m', 'largest step in 20 ms [cm]', '.1f')),
        [(one.name, *(float(np.quantile(one.errors[first:], part)) for part in (0.5, 0.95, 1.0)),
          float(one.steps[first:].max())) for one in passes])


def _draw(passes: list[Pass], first: int, own: float, figure: Figure) -> None:
    errors, steps = figure.subplots(1, 2, sharey=True)
    names = [one.name for one in passes]
    ours = [name.startswith(Anchored.name) for name in names]
    _bars(errors, names, ours, [float(np.median(one.errors[first:])) for one in passes], 0.3)
    errors.set(title='Median error [cm]')
    _bars(steps, names, ours, [float(one.steps[first:].max()) for one in passes], 0.1)
    steps.axvline(100.0 * own, color='black', linewidth=0.8, linestyle='--')
    note(steps, "the robot's own", (100.0 * own, -0.42), (4, 0), va='center')
    steps.set(title='Largest step in 20 ms [cm]')


def _bars(axes: Axes, names: list[str], ours: list[bool], sizes: list[float], most: float) -> None:
    """Draw a bar for each; one that is too long for the axis ends there, with its number."""
    colours = [STYLES[3]['color'] if one else GREY for one in ours]
    axes.barh(names, [100.0 * min(each, 0.9 * most) for each in sizes], 0.6, color=colours)
    for place, each in enumerate(sizes):
        cut = each > 0.9 * most
        number = f'{100.0 * each:.0f} \u2192' if cut else f'{100.0 * each:.1f}'
        note(axes, number, (100.0 * min(each, 0.9 * most), place), (-4 if cut else 4, 0),
             va='center', ha='right' if cut else 'left', color='white' if cut else 'black',
             fontweight='bold')
    axes.set(xlim=(0.0, 100.0 * most), ylim=(len(names) - 0.5, -0.5))
    axes.grid(visible=False, axis='y')
