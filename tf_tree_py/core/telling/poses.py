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

"""One pose as text: in a line, or in all the ways that people write one."""

from collections.abc import Callable, Mapping
from math import degrees

from ..geometry.pose import Pose


def as_line(pose: Pose) -> str:
    """Return translation and roll, pitch, yaw, so that many stand neatly below each other."""
    return f'{_translation(pose)}  {_rpy(pose)}'


def as_quaternion_line(pose: Pose) -> str:
    """Return translation and quaternion x y z w, likewise."""
    return f'{_translation(pose)}  q {" ".join(f"{part:9.6f}" for part in pose.rotation)}'


def as_matrix_lines(pose: Pose) -> str:
    """Return the 4x4 matrix, a row a line."""
    return '\n'.join(' '.join(f'{_whole(number, 6):10.6f}' for number in row)
                     for row in pose.as_matrix().tolist())


def as_all(pose: Pose) -> str:
    """Return all of them."""
    radians = ' '.join(f'{_whole(angle, 4):7.4f}' for angle in pose.as_rpy())
    return '\n'.join([as_quaternion_line(pose), f'{_rpy(pose)} ({radians} rad)',
                      as_matrix_lines(pose)])


FORMS: Mapping[str, Callable[[Pose], str]] = {
    'rpy': as_line, 'quaternion': as_quaternion_line, 'matrix': as_matrix_lines, 'all': as_all}
"""How a pose may be written, by name."""


def _translation(pose: Pose) -> str:
    return f'xyz {pose.x:7.3f} {pose.y:7.3f} {pose.z:7.3f} m'


def _rpy(pose: Pose) -> str:
    roll, pitch, yaw = (_whole(degrees(angle), 2) for angle in pose.as_rpy())
    return f'rpy {roll:7.2f} {pitch:7.2f} {yaw:7.2f} deg'


def _whole(number: float, digits: int) -> float:
    # Adding 0.0 makes of -0.0 a plain zero.
    return round(number, digits) + 0.0
