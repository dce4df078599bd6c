# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The results of the runs, as text and for JSON."""

from collections.abc import Sequence
from statistics import median
from typing import Any, NamedTuple

from tf_tree_py.core import Pose

from .image import Image

PLACED_WITHIN = 0.02


class Trial(NamedTuple):
    """
    The result of one run; metres.

    :ivar error: the distance between the true and the estimated pose of the block's top.
    :ivar off: the distance of the placed block from the tray's middle.
    :ivar remark: the reason why it ended early.
    :ivar sight: the image, and camera_T_block.
    """

    number: int
    error: float | None = None
    picked: bool = False
    placed: bool = False
    off: float | None = None
    remark: str = ''
    sight: tuple[Image, Pose] | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the result for JSON."""
        return {'run': self.number, 'detection_error_m': self.error, 'picked': self.picked,
                'placed': self.placed, 'placed_off_m': self.off, 'remark': self.remark}


def as_dict(way: str, trials: Sequence[Trial]) -> dict[str, Any]:
    """Return the counts, the errors (metres), and a row for each run."""
    errors = [trial.error for trial in trials if trial.error is not None]
    return {
        'way': way,
        'runs': len(trials),
        'picked': sum(trial.picked for trial in trials),
        'placed': sum(trial.placed for trial in trials),
        'detection_error_median_m': median(errors) if errors else None,
        'detection_error_worst_m': max(errors, default=None),
        'rows': [trial.as_dict() for trial in trials]}


def row(trial: Trial) -> str:
    """Return one run as a line."""
    error = '-' if trial.error is None else f'{trial.error * 1e3:.2f} mm'
    if trial.off is None:
        return f'{trial.number:>4}  seen {error:>10} off  not picked: {trial.remark}'
    placed = 'placed' if trial.placed else 'DROPPED'
    return (f'{trial.number:>4}  seen {error:>10} off  picked, {placed} {trial.off * 1e3:.1f} mm '
            'off')


def summary(trials: Sequence[Trial]) -> str:
    """Return all runs as one line."""
    counts = as_dict('', trials)
    line = (f'{counts["runs"]} runs: {counts["picked"]} picked, {counts["placed"]} placed within '
            f'{PLACED_WITHIN * 100:g} cm')
    if counts['detection_error_worst_m'] is None:
        return f'{line}; nothing was seen'
    return (f'{line}; detections {counts["detection_error_median_m"] * 1e3:.2f} mm off (median), '
            f'{counts["detection_error_worst_m"] * 1e3:.2f} mm at worst')
