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

"""What a benchmark finds: rows of measurements, and what of them is compared with a target."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from .timing import ratios, Rounds, Spread, spread

# The contestants, by the names under which the report shows them.
OURS = 'tf_tree_py'
DOCTOR = 'with a doctor'
TF_DOCTOR = 'tf_doctor'
TF_MONITOR = 'tf_monitor'
CORE = 'tf_tree_py core'
DEBIAN = 'C++ tf2'
JAZZY = 'C++ tf2 (Jazzy)'
RUST = 'Rust'
PYTRANSFORM = 'pytransform3d'
PLAIN = 'plain rclpy'
PLAIN_ZENOH = 'plain Zenoh'
BY_HAND = 'by hand'
TF2_ROS = 'tf2_ros'
EMPTY = 'TransformStamped()'


@dataclass
class Comparison:
    """
    A number that is judged, or at least worth telling.

    :ivar name: of what.
    :ivar spread: of its rounds.
    :ivar unit: such as 'x C++ tf2' or 'ms'.
    :ivar target: what it should not exceed; None if nothing was said.
    """

    name: str
    spread: Spread
    unit: str
    target: float | None = None

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without one."""
        return None if self.target is None else self.spread.median <= self.target


@dataclass
class Row:
    """
    One thing that several contestants did.

    :ivar group: the table it belongs to.
    :ivar name: what they did.
    :ivar unit: of the values, 'us', 'ms', 'bytes', ...
    :ivar values: of each contestant, one a round.
    """

    group: str
    name: str
    unit: str
    values: Rounds
    comparisons: list[Comparison] = field(default_factory=list)

    def compare(self, ours: str, theirs: str, target: float | None = None, *,
                name: str = '', unit: str = '') -> None:
        """Note the ratio of two contestants, if both took part."""
        if ours in self.values and theirs in self.values:
            found = spread(ratios(self.values[ours], self.values[theirs]))
            self.comparisons.append(Comparison(
                name or self.name, found, unit or f'x {theirs}', target))

    def judge(self, contestant: str, target: float | None, *, name: str = '',
              unit: str | None = None) -> None:
        """Note a contestant's own number."""
        self.comparisons.append(Comparison(
            name or self.name, spread(self.values[contestant]),
            self.unit if unit is None else unit, target))

    def as_dict(self) -> dict[str, Any]:
        """Return everything, for JSON."""
        return {**asdict(self),
                'medians': {name: spread(values).median for name, values in self.values.items()},
                'comparisons': [_comparison_as_dict(one) for one in self.comparisons]}


def _comparison_as_dict(comparison: Comparison) -> dict[str, Any]:
    return {**asdict(comparison), 'spread': comparison.spread._asdict(), 'met': comparison.met}


def scaled(values: Mapping[str, list[float]], factor: float) -> Rounds:
    """Return seconds as microseconds, and the like."""
    return {name: [value * factor for value in rounds] for name, rounds in values.items()}
