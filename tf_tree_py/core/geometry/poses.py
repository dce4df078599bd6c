# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Converting callers' poses to seven floats each.

A pose is a ``Pose``, seven numbers, a 4x4 matrix, or a ``Rotation`` or ``RigidTransform`` of
scipy. Those of scipy are recognised by their methods. A rotation alone is a pose with zero
translation. The validity of the numbers is checked later.

Pure functions: no state, any thread. An array that they return may be the caller's own memory, so
it is never changed; a history copies it.
"""

from collections.abc import Sequence
from typing import Any, NoReturn, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from . import se3
from .se3 import PoseTuple
from .so3 import Array
from ..errors import InvalidArgumentException
from ..times import Mask


class RotationLike(Protocol):
    """``Rotation`` of scipy."""

    def as_quat(self) -> object:
        """Return quaternions x y z w."""


class RigidTransformLike(Protocol):
    """``RigidTransform`` of scipy."""

    def as_components(self) -> object:
        """Return the translation and the rotation."""


PoseLike: TypeAlias = npt.ArrayLike | RotationLike | RigidTransformLike
"""
The types that are accepted as one pose: a ``Pose``, seven numbers, a (4, 4) matrix, or an object
of scipy.
"""

PosesLike: TypeAlias = PoseLike | Sequence[PoseLike]
"""The types that are accepted as many poses."""

# A quaternion whose squared length differs from one by less than this is used unchanged.
_UNIT_TOLERANCE = 1e-12

# They may have seven parts that ``float`` converts, but characters are no coordinates, and a set
# and a dictionary have no order that means x, y and z.
_NEVER_POSES = str, bytes, set, frozenset, dict

_WHAT = ('a pose is a Pose, seven numbers (x y z in metres, quaternion x y z w), a 4x4 matrix, or '
         'a Rotation or RigidTransform of scipy')
_HINTS = {
    (3,): 'Pose(x, y, z) makes a pose from a translation',
    (4,): 'Pose.from_parts(rotation=...) makes a pose from a quaternion',
    (6,): 'six numbers are ambiguous, angles or a rotation vector: use Pose.from_xyz_rpy or '
          'Pose.from_rotation_vector',
    (3, 3): 'Pose.from_parts(translation, Rotation.from_matrix(R).as_quat()) makes a pose '
            'from a rotation matrix',
    (3, 4): 'a matrix needs its last row, 0 0 0 1',
}


def checked_pose(given: Any) -> PoseTuple:
    """
    Return one pose as plain floats.

    :raises InvalidArgumentException: not a pose, or a matrix that is not a rigid transform.
    """
    try:
        if isinstance(given, _NEVER_POSES):
            raise TypeError
        x, y, z, qx, qy, qz, qw = map(float, given)
        return (x, y, z, qx, qy, qz, qw)
    except (TypeError, ValueError):
        array = array_of(given)
    if array is None or array.shape not in ((7,), (4, 4)):
        _refuse('', given, array)
    x, y, z, qx, qy, qz, qw = _from_matrices(array[None])[0] if array.ndim == 2 else array
    return (float(x), float(y), float(z), float(qx), float(qy), float(qz), float(qw))


def checked_poses(given: object) -> Array:
    """
    Return many poses as an array (N, 7).

    :param given: (N, 7) numbers, (N, 4, 4) matrices, a scipy object of N, or a sequence
        of anything that is valid as one pose.
    :raises InvalidArgumentException: another shape, or a matrix that is not a rigid transform.
    """
    array = array_of(given)
    if array is None and not isinstance(given, str) and hasattr(given, '__iter__'):
        return np.array([checked_pose(pose) for pose in given])
    if array is not None and array.shape[1:] == (4, 4):
        return _from_matrices(array)
    if array is None or array.shape[1:] != (7,):
        _refuse('poses are (N, 7) numbers or (N, 4, 4) matrices: ', given, array, 1)
    return np.ascontiguousarray(array)


def is_sound(pose: PoseTuple) -> bool:
    """Return whether a pose is finite and its quaternion has unit length."""
    x, y, z, qx, qy, qz, qw = pose
    # The comparison is also False for NaN and infinity.
    excess = qx * qx + qy * qy + qz * qz + qw * qw - 1.0 + 0.0 * x * y * z
    return -_UNIT_TOLERANCE < excess < _UNIT_TOLERANCE


def judged(poses: Array) -> tuple[Array, Mask]:
    """
    Return poses (N, 7) with unit quaternions, and which of them are good.

    The others, which are not finite or have no rotation, stay unchanged, and so do unit
    quaternions. If all are, the same array is returned; it is never changed.
    """
    q = poses[:, 3:]
    # einsum does not warn about numbers that are not finite; sum and dot do.
    excess = np.einsum('ij,ij->i', q, q) - 1.0
    # Zero, but NaN if any number is NaN or infinite; a comparison with NaN is false.
    nothing = 0.0 * float(np.einsum('ij->', poses))
    if float(np.einsum('i,i->', excess, excess)) + nothing < _UNIT_TOLERANCE ** 2:
        return poses, np.ones(len(poses), dtype=bool)
    with np.errstate(all='ignore'):
        # Scaled by the largest component, because the square of a very small or large number
        # would be zero or infinite.
        largest = np.abs(q).max(axis=1)
        scaled = q / largest[:, None]
        sizes = np.sqrt(np.einsum('ij,ij->i', scaled, scaled))
        good = np.isfinite(poses).all(axis=1) & np.isfinite(largest * sizes)
    unit = poses.copy()
    rough = good & (np.abs(excess) >= _UNIT_TOLERANCE)
    unit[rough, 3:] = scaled[rough] / sizes[rough, None]
    return unit, good


def array_of(given: object) -> Array | None:
    """Return the numbers of an object; None if it does not consist of numbers."""
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
    """Return the poses (N, 7) of matrices (N, 4, 4); NaN for matrices that are not finite."""
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


def _refuse(what: str, given: object, array: Array | None, many: int = 0) -> NoReturn:
    if array is None:
        hint = ('tf_tree_py.as_pose converts a message'
                if hasattr(given, 'translation') or hasattr(given, 'transform') else '')
        text = repr(given)
        had = text if len(text) < 80 else f'this {type(given).__name__}'
    else:
        hint = _HINTS.get(array.shape[many:], '')
        had = f'an array of the shape {array.shape}'
    raise InvalidArgumentException(
        f'{what}{had} is not a {"row of poses" if many else "pose"}: {_WHAT}'
        + (f'; {hint}' if hint else ''))
