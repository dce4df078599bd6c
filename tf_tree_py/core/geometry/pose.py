# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One pose with an operator: ``map_T_camera = map_T_base @ base_T_camera``.

``Pose`` is a tuple of seven floats with an operator and names; all formulas are in ``se3``,
whose functions accept a ``Pose`` like any such tuple.
"""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple, overload

import numpy as np
import numpy.typing as npt

from . import se3, so3
from .many_poses import as_plain, Poses, poses_of, product
from .so3 import Array, Quaternion, Vector3


class Pose(NamedTuple):
    """
    A rigid transform: metres and a unit quaternion, immutable.

    ``a_T_b @ b_T_c`` is a_T_c; ``a_T_b @ b_p`` transforms points (3,) or (N, 3) from
    coordinates in b to coordinates in a. Either operand may also be poses (N, 7), or a matrix
    (4, 4). The constructor does not check its numbers; the ``from_*`` methods do.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    qw: float = 1.0

    @classmethod
    def from_parts(cls, translation: npt.ArrayLike = (0.0, 0.0, 0.0),
                   rotation: npt.ArrayLike = so3.IDENTITY) -> 'Pose':
        """
        Return the pose of a translation (3,), metres, and a quaternion (4,), x y z w.

        :raises ValueError: wrong shapes, numbers that are not finite, or a zero quaternion.
        """
        t, q = np.asarray(translation, dtype=float), np.asarray(rotation, dtype=float)
        if t.shape != (3,) or q.shape != (4,):
            raise ValueError(
                f'a translation has 3 numbers and a quaternion 4, not {t.shape} and {q.shape}')
        if not np.isfinite(t).all():
            raise ValueError(f'the translation {t.tolist()} is not finite')
        qx, qy, qz, qw = q.tolist()
        x, y, z = t.tolist()
        return cls(x, y, z, *so3.normalize((qx, qy, qz, qw)))

    @classmethod
    def from_xyz_rpy(cls, x: float = 0.0, y: float = 0.0, z: float = 0.0,
                     roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> 'Pose':
        """Return the pose of a URDF origin: metres; radians about the fixed axes x, y, z."""
        return cls.from_parts((x, y, z), so3.from_rpy(roll, pitch, yaw))

    @classmethod
    def from_rotation_vector(cls, rotation_vector: Vector3,
                             translation: npt.ArrayLike = (0.0, 0.0, 0.0)) -> 'Pose':
        """Return the pose of a rotation vector (3,), radians, and a translation (3,), metres."""
        return cls.from_parts(translation, so3.exp(rotation_vector))

    @classmethod
    def from_matrix(cls, matrix: npt.ArrayLike) -> 'Pose':
        """
        Return the pose of a (4, 4) homogeneous matrix.

        :raises ValueError: the matrix is not a rigid transform.
        """
        return cls(*se3.from_matrix(matrix))

    @property
    def translation(self) -> Vector3:
        """Return the origin of the source frame in the target frame, metres."""
        return self[:3]

    @property
    def rotation(self) -> Quaternion:
        """Return the unit quaternion, x y z w."""
        return self[3:]

    def as_matrix(self) -> Array:
        """Return the (4, 4) homogeneous matrix."""
        return se3.as_matrix(self)

    def as_rpy(self) -> Vector3:
        """Return (roll, pitch, yaw), radians, about the fixed axes x, y, z."""
        return so3.as_rpy(self.rotation)

    def as_rotation_vector(self) -> Vector3:
        """Return the rotation vector, radians, of length 0 to pi."""
        return so3.log(self.rotation)

    def inverse(self) -> 'Pose':
        """Return b_T_a of a_T_b."""
        return Pose(*se3.inverse(self))

    @overload
    def __matmul__(self, other: 'Pose') -> 'Pose': ...

    @overload
    def __matmul__(self, other: Poses) -> Poses: ...

    @overload
    def __matmul__(self, other: npt.NDArray[Any] | Sequence[Any]) -> Array: ...

    def __matmul__(self, other: Any) -> Any:
        if isinstance(other, Pose):
            return Pose(*se3.compose(self, other))
        return _as_one(product(np.array(self), other))

    def __rmatmul__(self, other: Any) -> Any:
        return _as_one(product(poses_of(other), self))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        # Otherwise numpy would treat the pose in `array @ pose` as a vector of seven.
        if ufunc is np.matmul and method == '__call__' and not options:
            left, right = inputs
            return left @ right if isinstance(left, Pose) else right.__rmatmul__(left)
        return as_plain(ufunc, method, inputs, options)

    def __str__(self) -> str:
        # Adding zero changes -0.0 to 0.0.
        x, y, z = (round(value, 3) + 0.0 for value in self.translation)
        roll, pitch, yaw = (round(math.degrees(angle), 2) + 0.0 for angle in self.as_rpy())
        return f'({x:.3f}, {y:.3f}, {z:.3f}) m, rpy ({roll:.2f}, {pitch:.2f}, {yaw:.2f}) deg'


def _as_one(result: Any) -> Any:
    """Return a single pose as a ``Pose``, and anything else unchanged."""
    if isinstance(result, Poses) and result.ndim == 1:
        return Pose(*result.tolist())
    return result
