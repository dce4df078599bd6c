# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The list of all labs, in the order of the course."""

from collections.abc import Callable
import importlib
from types import ModuleType
from typing import NamedTuple

from . import (
    anchor,
    calibrate,
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
           cycle, remount, one_edge, uncertainty, calibrate, continuous, gyro, prediction,
           switch_over, anchor, splat)
_LIVE = (latency, remount, one_edge, startup, static_spam, cycle, anchor)


class Lab(NamedTuple):
    """
    One experiment.

    :ivar summary: a one-line description of what it shows.
    :ivar run: runs it on a buffer in this process.
    :ivar live: whether it can also run over DDS, between separate processes.
    """

    name: str
    summary: str
    run: Callable[[], Report]
    live: bool

    def run_live(self) -> Report:
        """
        Run it over DDS.

        :raises ImportError: ROS is not available.
        """
        module = importlib.import_module(f'{__package__}.live.live_{self.name.replace("-", "_")}')
        return module.run()  # type: ignore[no-any-return]


def _lab(module: ModuleType) -> Lab:
    name = module.__name__.rpartition('.')[2].replace('_', '-')
    return Lab(name, module.SUMMARY, module.run, module in _LIVE)


LABS = {lab.name: lab for lab in map(_lab, _COURSE)}
