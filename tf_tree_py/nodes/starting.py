# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Entry points of the executables; without ROS each prints one sentence about that."""

from collections.abc import Sequence
from functools import partial
from importlib import import_module
import sys

from tf_tree_py.command import endings


def _start(name: str) -> int:
    """Run the executable of a module in this package; return its exit status."""
    def work(_: Sequence[str]) -> int:
        try:
            program = import_module(f'.{name}', __package__)
        except ModuleNotFoundError as error:
            raise endings.needs_ros('', error) from error
        status: int = program.main()
        return status

    return endings.run(name, work, interrupted=endings.FINE)


buffer_server = partial(_start, 'buffer_server')
edge_switch = partial(_start, 'edge_switch')
five_frame_demo = partial(_start, 'five_frame_demo')
five_frame_listener = partial(_start, 'five_frame_listener')
five_frame_publisher = partial(_start, 'five_frame_publisher')
relocalisation_anchor = partial(_start, 'relocalisation_anchor')
robot_state_publisher = partial(_start, 'robot_state_publisher')
static_transform_publisher = partial(_start, 'static_transform_publisher')
tf_relay = partial(_start, 'tf_relay')
# The status needs no ROS.
tf_share = partial(_start, 'share_status' if '--status' in sys.argv else 'tf_share')
urdf_broadcaster = partial(_start, 'urdf_broadcaster')
