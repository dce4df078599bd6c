# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The list of all labs, in the order of the course."""

from collections.abc import Callable
import importlib
from typing import NamedTuple

from .report import Report

_COURSE = ('order', 'direction', 'planar', 'latency', 'interpolation', 'warehouse', 'startup',
           'static_spam', 'cycle', 'remount', 'one_edge', 'uncertainty', 'calibrate',
           'continuous', 'gyro', 'prediction', 'switch_over', 'anchor', 'splat')
_LIVE = ('latency', 'remount', 'one_edge', 'startup', 'static_spam', 'cycle', 'anchor')


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


def _lab(module_name: str) -> Lab:
    module = importlib.import_module(f'.{module_name}', __package__)
    return Lab(module_name.replace('_', '-'), module.SUMMARY, module.run, module_name in _LIVE)


LABS = {lab.name: lab for lab in map(_lab, _COURSE)}
