# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A forklift misses its pallets, because its camera's mounting or its stamps are wrong."""

from functools import partial
from math import degrees, dist, radians

import numpy as np
from tf_tree_py import screws
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.calibration import calibrate, Calibration, Limits, Observations
from tf_tree_py.core import from_seconds, Pose, se3, UNLIMITED
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.times import Stamps

from .report import Column, Figure, Report, STYLES, Table

SUMMARY = 'pallets land off while the forklift moves: the mounting, or the stamps?'

SPEED, LATE_S, TURNED = 0.5, 0.080, radians(1.0)
_SEED, _NOISE_M, _NOISE_RAD = 7, 0.003, 0.003
_TRUE = Pose.from_xyz_rpy(x=0.3, z=1.5, pitch=0.25)
_PALLET = Pose.from_xyz_rpy(x=4.0, y=0.6, z=0.1, yaw=0.2)
_EDGE = ('base_link', 'camera')
_SCENES = {'nothing': (0.0, 0.0), 'the mounting': (TURNED, 0.0), 'the stamps': (0.0, LATE_S),
           'both': (TURNED, LATE_S)}


def _map_T_base(seconds: Array) -> Array:
    """Return poses (N, 7) of a drive forwards and backwards on curves, at up to 0.5 m/s."""
    phase = SPEED * seconds / 1.2
    poses = np.zeros((len(seconds), 7))
    poses[:, 0], poses[:, 1] = 1.2 * np.sin(phase), 0.4 * np.sin(0.6 * phase)
    yaw = 0.5 * np.sin(0.8 * phase + 0.5)
    poses[:, 5], poses[:, 6] = np.sin(0.5 * yaw), np.cos(0.5 * yaw)
    return poses


def drive(turned: float, late_s: float, *, turning: bool = True
          ) -> tuple[BufferCore, Observations]:
    """
    Return a tree with a mounting that is rotated by an angle, and the camera's observations.

    :param turning: whether the forklift turns.
    """
    rng = np.random.default_rng(_SEED)
    buffer, seconds = BufferCore(cache_time=UNLIMITED), np.arange(0.0, 40.0, 0.02)
    poses = _map_T_base(seconds)
    taken = np.arange(1.0, 39.0, 0.2)
    true = _map_T_base(taken)
    if not turning:
        poses[:, 3:] = true_q = (0.0, 0.0, 0.0, 1.0)
        true[:, 3:] = true_q
    buffer.insert_track('map', 'base_link', _stamps(seconds), poses)
    wrong = Pose.from_rotation_vector((0.0, 0.0, turned), _TRUE[:3]) @ Pose.from_parts(
        rotation=_TRUE.rotation)
    buffer.insert(*_EDGE, 0, wrong, static=True)
    camera = se3.compose_many(true, np.array(_TRUE))
    seen = se3.compose_many(se3.inverse_many(camera), np.array(_PALLET))
    noise = rng.normal(size=(len(taken), 6)) * ([_NOISE_M] * 3 + [_NOISE_RAD] * 3)
    seen = se3.compose_many(seen, screws.exp_many(noise))
    return buffer, Observations('camera', _stamps(taken + late_s), seen, 'map', 'pallet')


def _stamps(seconds: Array) -> Stamps:
    return from_seconds(1.0) + np.round(seconds * 1e9).astype(np.int64)


def run() -> Report:
    """Simulate the forklift with each fault, and calibrate."""
    found = {name: _calibrated(*drive(*fault)) for name, fault in _SCENES.items()}
    straight = _calibrated(*drive(TURNED, LATE_S, turning=False))
    both = found['both']
    unexplained = {each.name.value: each.unexplained_m for each in both.explanations}
    before, after = _budget(both)
    offset = both.time_offset_s or 0.0
    return Report(
        tables=[_verdicts(found, straight), _shares(both)],
        law=f'Of {unexplained["nothing"] * 100.0:.1f} cm the stamps leave '
            f'{unexplained["time"] * 100.0:.1f} cm, the mounting '
            f'{unexplained["edge"] * 100.0:.1f} cm, and both '
            f'{unexplained["edge and time"] * 1e3:.1f} mm: {offset * 1e3:.1f} ms late, and turned '
            f'by {degrees(both.edge.turned_rad):.2f} degrees.',
        remarks=[
            'The motion of a forklift on a floor does not determine the height of its camera: '
            "the calibration keeps the tree's value, and reports it as unknown. If the forklift "
            'never turns, the whole translation of the mounting is undetermined.',
            f'The budget of a lookup, with a mounting that was known to 1 degree: {before:.0%} of '
            f'the error at the pallet came from base_link -> camera; with the new edge and its '
            f'covariance {after:.0%}.'],
        numbers={'offset_s': offset, 'offset_sigma_s': both.time_offset_sigma_s or 0.0,
                 'turned_rad': both.edge.turned_rad, 'share_before': before,
                 'share_after': after,
                 **{f'{name.replace(" ", "_")}_m': value for name, value in unexplained.items()}},
        draw=partial(_draw, both))


def _calibrated(buffer: BufferCore, seen: Observations) -> Calibration:
    return calibrate(buffer, _EDGE, seen, time=True, limits=Limits(max_offset_s=0.2))


def _budget(found: Calibration) -> tuple[float, float]:
    """Return the mounting's share of the error of the rotation, before and after."""
    shares = []
    for covariance in (np.diag([1e-4] * 3 + [TURNED ** 2] * 3), found.edge.covariance):
        buffer = BufferCore(cache_time=UNLIMITED)
        buffer.insert('map', 'base_link', 0, Pose(), static=True,
                      covariance=np.diag([4e-4] * 3 + [radians(0.3) ** 2] * 3))
        buffer.insert(*_EDGE, 0, found.edge.after, static=True, covariance=covariance)
        buffer.insert('camera', 'pallet', 0, Pose(x=4.0), static=True)
        [share] = [each for each in buffer.lookup_budget('map', 'pallet')
                   if each.child == 'camera']
        shares.append(share.rotation)
    return shares[0], shares[1]


def _verdicts(found: dict[str, Calibration], straight: Calibration) -> Table:
    rows = [(name, str(each.verdict), each.time_offset_s, each.edge.turned_rad,
             dist(each.edge.before[:3], each.edge.after[:3]), _hidden(each))
            for name, each in {**found, 'both, never turning': straight}.items()]
    return Table(
        f'What is wrong, and what was found, at {SPEED} m/s',
        (Column('wrong', 'what is wrong'), Column('verdict', 'verdict'),
         Column('offset_s', 'late [ms]', '.1f'), Column('turned_rad', 'turned [deg]', '.2f'),
         Column('moved_m', 'moved [mm]', '.1f'), Column('hidden', 'not visible')), rows)


def _hidden(found: Calibration) -> str:
    return ', '.join('xyz'[int(np.argmax(np.abs(each.axis)))] for each in found.unobservable)


def _shares(found: Calibration) -> Table:
    best = min(each.criterion for each in found.explanations)
    return Table(
        'Both are wrong: the residual that each explanation leaves',
        (Column('explanation', 'it is'), Column('unexplained_m', 'left [mm]', '.1f'),
         Column('criterion', 'criterion', '+.0f')),
        [(str(each.name), each.unexplained_m, each.criterion - best)
         for each in found.explanations])


def _draw(found: Calibration, figure: Figure) -> None:
    left, right = figure.subplots(1, 2, sharey=True)
    trace = found.trace
    seconds = (trace.stamps - trace.stamps[0]) / 1e9
    for axes, places in ((left, trace.speed), (right, seconds)):
        for style, name, off in zip(STYLES[2:0:-1], ('before calibration', 'after'),
                                    (trace.before_m, trace.after_m), strict=True):
            axes.plot(places, off * 100.0, **{**style, 'linestyle': ''},
                      label=name if axes is left else '')
    left.set(xlabel='speed of the pallet past the camera [m/s]', ylabel='error of the pallet [cm]',
             title='Error by speed')
    right.set(xlabel='time [s]', title='Error along the drive')
