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

"""The list of all labs, in the order of the course."""

from collections.abc import Callable
import importlib
from types import ModuleType
from typing import NamedTuple

from . import (
    anchor,
    continuous,
    cycle,
    direction,
    gyro,
    interpolation,
    latency,
    one_edge,
    order,
    planar,
    prediction,
    remount,
    splat,
    startup,
    static_spam,
    switch_over,
    uncertainty,
    warehouse,
)
from .report import Report

_COURSE = (order, direction, planar, latency, interpolation, warehouse, startup, static_spam,
           cycle, remount, one_edge, uncertainty, continuous, gyro, prediction,
           switch_over, anchor, splat)
_LIVE = (latency, remount, one_edge, startup, static_spam, cycle, anchor)


class Lab(NamedTuple):
    """
    One experiment.

    :ivar summary: one line that says what it shows.
    :ivar run: runs it on a buffer in this process.
    :ivar live: whether it can also run over DDS, between processes of its own.
    """

    name: str
    summary: str
    run: Callable[[], Report]
    live: bool

    def run_live(self) -> Report:
        """
        Run it over DDS.

        :raises ImportError: there is no ROS here.
        """
        module = importlib.import_module(f'{__package__}.live.{self.name.replace("-", "_")}')
        return module.run()  # type: ignore[no-any-return]


def _lab(module: ModuleType) -> Lab:
    name = module.__name__.rpartition('.')[2].replace('_', '-')
    return Lab(name, module.SUMMARY, module.run, module in _LIVE)


LABS = {lab.name: lab for lab in map(_lab, _COURSE)}
