# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One pose as text: on a line, or in all common notations."""

from collections.abc import Callable, Mapping
from math import degrees

from tf_tree_py.core.geometry.pose import Pose


def as_line(pose: Pose) -> str:
    """Return translation and roll, pitch, yaw, in columns of constant width."""
    return f'{_translation(pose)}  {_rpy(pose)}'


def as_quaternion_line(pose: Pose) -> str:
    """Return translation and quaternion x y z w, in columns of constant width."""
    return f'{_translation(pose)}  q {" ".join(f"{part:9.6f}" for part in pose.rotation)}'


def as_matrix_lines(pose: Pose) -> str:
    """Return the 4x4 matrix, one row on each line."""
    return '\n'.join(' '.join(f'{_whole(number, 6):10.6f}' for number in row)
                     for row in pose.as_matrix().tolist())


def as_all(pose: Pose) -> str:
    """Return the pose in all notations."""
    radians = ' '.join(f'{_whole(angle, 4):7.4f}' for angle in pose.as_rpy())
    return '\n'.join([as_quaternion_line(pose), f'{_rpy(pose)} ({radians} rad)',
                      as_matrix_lines(pose)])


FORMS: Mapping[str, Callable[[Pose], str]] = {
    'rpy': as_line, 'quaternion': as_quaternion_line, 'matrix': as_matrix_lines, 'all': as_all}
"""The notations of a pose, by name."""


def _translation(pose: Pose) -> str:
    return f'xyz {pose.x:7.3f} {pose.y:7.3f} {pose.z:7.3f} m'


def _rpy(pose: Pose) -> str:
    roll, pitch, yaw = (_whole(degrees(angle), 2) for angle in pose.as_rpy())
    return f'rpy {roll:7.2f} {pitch:7.2f} {yaw:7.2f} deg'


def _whole(number: float, digits: int) -> float:
    # Adding 0.0 turns -0.0 into 0.0.
    return round(number, digits) + 0.0
