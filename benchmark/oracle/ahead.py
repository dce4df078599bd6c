# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How often the covariance of a prediction covers its error: ``python3 -m benchmark.oracle.ahead``.

Seven robots move for 24 s. They are predicted up to 38 times, each time for several times ahead.
The table has the shares of the errors, in percent, inside the regions of 68 and of 95 %.
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
import sys
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core.geometry.pose import Pose

from .movers import FINE_HZ, MOVERS, sampled
from .robot import Array, Motion, one
from .tables import put_into_page

RATES_HZ = (10, 50, 100, 500)
# Parts of the samples' period, and milliseconds.
_PARTS, _AHEADS_MS = (0.0, 0.1, 0.5), (10, 50, 100, 200, 500, 1000)
_DRIVE_S, _FIRST_S, _LAST_S, _EVERY_S = 24.0, 11.0, 22.5, 0.3
_MS = 1_000_000
_FIRST_STAMP, _HORIZON = 1000 * _MS, 2000 * _MS
# The directions whose variance is less, relative to the largest, are certain; an error there is
# one of rounding.
_CERTAIN, _ROUNDING = 1e-12, 1e-6
_REGIONS = (0.6827, 0.95)


class Setting(NamedTuple):
    """
    Drives of one robot.

    :ivar noise: as a multiple of the usual one.
    """

    robot: str
    rate_hz: int
    noise: float


def covered(setting: Setting, seed: int) -> Array:
    """Return whether errors are in the regions of 68 and of 95 %, (times ahead, N, 2)."""
    number = list(MOVERS).index(setting.robot)
    truth = MOVERS[setting.robot](np.random.default_rng([seed, number]), _DRIVE_S)
    samples = sampled(truth, setting.rate_hz, setting.noise,
                      np.random.default_rng([seed, setting.rate_hz, number]))
    aheads = [round(part * 1000 / setting.rate_hz * _MS) for part in _PARTS]
    aheads += [milliseconds * _MS for milliseconds in _AHEADS_MS]
    buffer, found, due = BufferCore(), [], _FIRST_S
    for fine, row in zip(samples.numbers.tolist(), samples.poses.rows().tolist(), strict=True):
        stamp = _FIRST_STAMP + fine * _MS
        buffer.insert('odom', 'base', stamp, Pose._make(row))
        if due <= fine / FINE_HZ <= _LAST_S:
            due = fine / FINE_HZ + _EVERY_S
            found.append([_inside(buffer, stamp + ahead, _at(truth, fine + ahead / _MS))
                          for ahead in aheads])
    return np.swapaxes(np.array(found, dtype=float), 0, 1)


def _at(truth: Motion, fine: float) -> Motion:
    """Return the true pose at a time, in steps of the simulation."""
    before = truth[int(fine)]
    if fine == int(fine):
        return before
    part, step = fine - int(fine), truth[int(fine):int(fine) + 2].steps()[0]
    return one(part * step.positions, part * step.rotations.as_rotvec()).after(before)


def _inside(buffer: BufferCore, stamp: int, truth: Motion) -> list[bool]:
    """Return whether the error of a prediction is in each of the regions."""
    found = buffer.predict('odom', 'base', stamp, _HORIZON)
    off = np.concatenate([truth.positions - found.pose[:3], (
        truth.rotations * Rotation.from_quat(found.pose[3:]).inv()).as_rotvec()])
    variances, directions = np.linalg.eigh(found.covariance)
    uncertain = variances > max(_CERTAIN * variances[-1], _CERTAIN**2)
    along = directions.T @ off
    if (np.abs(along[~uncertain]) > _ROUNDING).any():
        return [False] * len(_REGIONS)
    square = (along[uncertain]**2 / variances[uncertain]).sum()
    return [bool(square <= chi2.ppf(region, max(uncertain.sum(), 1))) for region in _REGIONS]


# --- the table

def table(seeds: int, rates_hz: Sequence[int] = RATES_HZ) -> str:
    """Return the table of all robots, in Markdown."""
    settings = [Setting(robot, rate, noise) for robot in MOVERS for noise in (1.0, 0.0)
                for rate in rates_hz]
    # Not forked: this process may have threads.
    with ProcessPoolExecutor(mp_context=get_context('spawn')) as pool:
        shares = list(pool.map(partial(_shares, seeds), settings))
    parts = ['the newest', *(f'{part:g} of a period' for part in _PARTS[1:])]
    names = [*parts, *(f'{milliseconds} ms' for milliseconds in _AHEADS_MS)]
    lines = [f'{seeds} drives in each row.', '', f'| robot | Hz | {" | ".join(names)} |',
             f'| --- | --- |{" --- |" * len(names)}']
    for setting, row in zip(settings, shares, strict=True):
        robot = setting.robot if setting.noise else f'{setting.robot}, no noise'
        lines.append(f'| {robot} | {setting.rate_hz} | {" | ".join(row)} |')
    return '\n'.join(lines) + '\n'


def _shares(seeds: int, setting: Setting) -> list[str]:
    found = np.concatenate([covered(setting, seed) for seed in range(seeds)], axis=1)
    return [f'{100 * low:.0f}, {100 * high:.0f}' for low, high in found.mean(axis=1).tolist()]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(
        prog='python3 -m benchmark.oracle.ahead',
        description='Let simulated robots judge the covariances of predictions.')
    parser.add_argument('--seeds', type=int, default=20, help='how many drives in each row')
    parser.add_argument('--rates', type=int, nargs='+', default=RATES_HZ, metavar='HZ',
                        help='how often the robots are sampled')
    parser.add_argument('--docs', action='store_true',
                        help='also put the table into docs/oracle.md')
    options = parser.parse_args(arguments)
    found = table(options.seeds, options.rates)
    print(found)
    if options.docs:
        put_into_page('predictions', found)
    return 0


if __name__ == '__main__':
    sys.exit(main())
