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

"""Entry points of the executables: without ROS each says so in one line."""

from functools import partial
from importlib import import_module
import sys


def _start(name: str) -> int:
    """Run the executable of a module beside this one; return its exit status."""
    try:
        program = import_module(f'.{name}', __package__)
    except ModuleNotFoundError as error:
        missing = (error.name or '').partition('.')[0]
        if missing in ('', 'tf_tree_py'):
            raise
        print(f'{name}: needs ROS 2, and {missing} is not installed: source a ROS 2 installation, '
              'or let scripts/setup of the tf_tree_py repository make one from PyPI',
              file=sys.stderr)
        return 1
    status: int = program.main()
    return status


buffer_server = partial(_start, 'buffer_server')
edge_switch = partial(_start, 'edge_switch')
five_frame_demo = partial(_start, 'five_frame_demo')
five_frame_listener = partial(_start, 'five_frame_listener')
five_frame_publisher = partial(_start, 'five_frame_publisher')
relocalisation_anchor = partial(_start, 'relocalisation_anchor')
robot_state_publisher = partial(_start, 'robot_state_publisher')
static_transform_publisher = partial(_start, 'static_transform_publisher')
tf_relay = partial(_start, 'tf_relay')
urdf_broadcaster = partial(_start, 'urdf_broadcaster')
