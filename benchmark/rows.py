# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The results of a benchmark: rows of measurements, and comparisons with targets."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from .timing import ratios, Rounds, Spread, spread

# The names of the contestants in the report.
OURS = 'tf_tree_py'
DOCTOR = 'with a doctor'
TF_DOCTOR = 'tf_doctor'
TF_MONITOR = 'tf_monitor'
CORE = 'tf_tree_py core'
PURE = 'tf_tree_py, pure Python'
DEBIAN = 'C++ tf2'
JAZZY = 'C++ tf2 (Jazzy)'
RUST = 'Rust'
PYTRANSFORM = 'pytransform3d'
PLAIN = 'plain rclpy'
RAW = 'rosbags, raw'
PLAIN_ZENOH = 'plain Zenoh'
BY_HAND = 'by hand'
TF2_ROS = 'tf2_ros'
GTSAM = 'GTSAM'
KINHEC = 'KinHEC'
EMPTY = 'TransformStamped()'
SHARED = 'shared tree'
OWN = 'own tree'
TF_SHARE = 'tf_share'
ALONE = 'no listener'
BESIDE = 'no listener, beside tf_share'


@dataclass
class Comparison:
    """
    A number that is compared with a target, or reported without one.

    :ivar name: the name of the quantity.
    :ivar spread: the spread over its rounds.
    :ivar unit: such as 'x C++ tf2' or 'ms'.
    :ivar target: the upper limit; None without a target.
    """

    name: str
    spread: Spread
    unit: str
    target: float | None = None

    @property
    def met(self) -> bool | None:
        """Return whether the target is met; None without one."""
        return None if self.target is None else self.spread.median <= self.target


@dataclass
class Row:
    """
    One measurement of several contestants.

    :ivar group: the table that it belongs to.
    :ivar name: the name of the measurement.
    :ivar unit: of the values, 'us', 'ms', 'bytes', ...
    :ivar values: of each contestant, one for each round.
    """

    group: str
    name: str
    unit: str
    values: Rounds
    comparisons: list[Comparison] = field(default_factory=list)

    def compare(self, ours: str, theirs: str, target: float | None = None, *,
                name: str = '', unit: str = '') -> None:
        """Add the ratio of two contestants, if both were measured."""
        if ours in self.values and theirs in self.values:
            found = spread(ratios(self.values[ours], self.values[theirs]))
            self.comparisons.append(Comparison(
                name or self.name, found, unit or f'x {theirs}', target))

    def judge(self, contestant: str, target: float | None, *, name: str = '',
              unit: str | None = None) -> None:
        """Add a number of a single contestant."""
        self.comparisons.append(Comparison(
            name or self.name, spread(self.values[contestant]),
            self.unit if unit is None else unit, target))

    def as_dict(self) -> dict[str, Any]:
        """Return everything, for JSON."""
        return {**asdict(self),
                'medians': {name: spread(values).median for name, values in self.values.items()},
                'comparisons': [_comparison_as_dict(one) for one in self.comparisons]}

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> 'Row':
        """Return the row of which ``as_dict`` returned this."""
        comparisons = [Comparison(one['name'], Spread(**one['spread']), one['unit'], one['target'])
                       for one in stored['comparisons']]
        return cls(stored['group'], stored['name'], stored['unit'], stored['values'], comparisons)


def _comparison_as_dict(comparison: Comparison) -> dict[str, Any]:
    return {**asdict(comparison), 'spread': comparison.spread._asdict(), 'met': comparison.met}


def scaled(values: Mapping[str, list[float]], factor: float) -> Rounds:
    """Return values multiplied by a factor, such as seconds as microseconds."""
    return {name: [value * factor for value in rounds] for name, rounds in values.items()}
