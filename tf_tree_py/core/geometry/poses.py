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

"""
What callers give as poses, turned into seven floats each.

A pose is a ``Pose``, seven numbers, a 4x4 matrix, or a ``Rotation`` or
``RigidTransform`` of scipy. Those of scipy are recognised by their methods. A rotation
alone is a pose whose translation is zero. Whether the numbers can be used is checked
later.
"""

from typing import Any, NoReturn

import numpy as np

from .se3 import PoseTuple
from .so3 import Array
from ..errors import InvalidArgumentException
from ..geometry import se3

_WHAT = ('a pose is a Pose, seven numbers (x y z in metres, quaternion x y z w), a 4x4 matrix, or '
         'a Rotation or RigidTransform of scipy')
_HINTS = {
    (3,): 'of a translation alone, Pose(x, y, z) makes one',
    (4,): 'of a quaternion alone, Pose.from_parts(rotation=...) makes one',
    (6,): 'six numbers could be angles or a rotation vector: Pose.from_xyz_rpy and '
          'Pose.from_rotation_vector say which',
    (3, 3): 'Pose.from_parts(translation, Rotation.from_matrix(R).as_quat()) makes one of a '
            'rotation matrix',
    (3, 4): 'a matrix needs its last row, 0 0 0 1',
}


def checked_pose(given: Any) -> PoseTuple:
    """
    Return one pose as plain floats.

    :raises InvalidArgumentException: not a pose, or a matrix that is no rigid transform.
    """
    try:
        x, y, z, qx, qy, qz, qw = map(float, given)
        return (x, y, z, qx, qy, qz, qw)
    except (TypeError, ValueError):
        array = _array_of(given)
    if array is None or array.shape not in ((7,), (4, 4)):
        _refuse('', given, array)
    x, y, z, qx, qy, qz, qw = _from_matrices(array[None])[0] if array.ndim == 2 else array
    return (float(x), float(y), float(z), float(qx), float(qy), float(qz), float(qw))


def checked_poses(given: Any) -> Array:
    """
    Return many poses as an array (N, 7).

    :param given: (N, 7) numbers, (N, 4, 4) matrices, a scipy object of N, or a sequence
        of whatever one pose may be.
    :raises InvalidArgumentException: another shape, or a matrix that is no rigid transform.
    """
    array = _array_of(given)
    if array is None and not isinstance(given, str) and hasattr(given, '__iter__'):
        return np.array([checked_pose(pose) for pose in given])
    if array is not None and array.ndim == 3 and array.shape[1:] == (4, 4):
        return _from_matrices(array)
    if array is None or array.ndim != 2 or array.shape[1] != 7:
        _refuse('poses are (N, 7) numbers or (N, 4, 4) matrices: ', given, array, 1)
    return np.ascontiguousarray(array)


def _array_of(given: Any) -> Array | None:
    """Return the numbers of an object; None if it is not made of numbers."""
    if hasattr(given, 'as_components'):  # RigidTransform
        translation, rotation = given.as_components()
        return np.concatenate([translation, rotation.as_quat()], axis=-1)
    if hasattr(given, 'as_quat'):  # Rotation
        q = np.asarray(given.as_quat(), dtype=float)
        return np.concatenate([np.zeros((*q.shape[:-1], 3)), q], axis=-1)
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        return None
    return array if array.ndim else None


def _from_matrices(matrices: Array) -> Array:
    """Return the poses (N, 7) of matrices (N, 4, 4); NaN of those that are not finite."""
    poses = np.full((len(matrices), 7), np.nan)
    finite = np.isfinite(matrices).all(axis=(1, 2))
    try:
        poses[finite] = se3.from_matrix_many(matrices[finite])
    except ValueError:
        for number in np.flatnonzero(finite).tolist():
            try:
                se3.from_matrix(matrices[number])
            except ValueError as error:
                raise InvalidArgumentException(f'poses[{number}]: {error}') from None
        raise
    return poses


def _refuse(what: str, given: Any, array: Array | None, many: int = 0) -> NoReturn:
    if array is None:
        hint = ('of a message, tf_tree_py.as_pose makes one'
                if hasattr(given, 'translation') or hasattr(given, 'transform') else '')
        text = repr(given)
        had = text if len(text) < 80 else f'this {type(given).__name__}'
    else:
        hint = _HINTS.get(array.shape[many:], '')
        had = f'an array of the shape {array.shape}'
    raise InvalidArgumentException(
        f'{what}{had} is no {"row of poses" if many else "pose"}: {_WHAT}'
        + (f'; {hint}' if hint else ''))
