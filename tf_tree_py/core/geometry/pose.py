# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One pose, or many, with an operator: ``map_T_camera = map_T_base @ base_T_camera``.

``Pose`` is a tuple of seven floats with an operator and names, ``Poses`` an array (N, 7). All
formulas are in ``se3``, whose functions accept a ``Pose`` like any such tuple. Arguments with
many poses are recognised by their shape: (..., 3) are points, (..., 7) poses, (..., 4, 4)
matrices.
"""

from collections.abc import Sequence
import math
from typing import Any, NamedTuple, overload, TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from . import se3, so3
from .poses import array_of
from .so3 import Array, Quaternion, Vector3

if TYPE_CHECKING:
    _Floats = np.ndarray[Any, np.dtype[np.float64]]
else:
    _Floats = np.ndarray

_WHAT = ('the right operand of @ must be points (..., 3), poses (..., 7), matrices (..., 4, 4), '
         'or a Rotation or RigidTransform of scipy')
_NO_ROWS = ('this part of an array of poses has no rows of seven numbers: select rows '
            '(poses[2:5]), or convert an array (N, 7) with Poses(array)')


class Poses(_Floats):
    """
    Poses as ``lookup_many`` returns them: an array (N, 7), x y z qx qy qz qw.

    For numpy and pandas it is an ordinary array: arithmetic and columns return plain arrays.
    Rows stay poses. ``a_T_b @ b_T_c`` composes, row by row or with one pose for all;
    ``a_T_b @ b_p`` transforms points (N, 3), one for each pose, or one point (3,) for all.
    """

    # Whether the last axis is that of poses. It is False for views that numpy makes itself, such
    # as a transposed one.
    _has_rows = False

    def __new__(cls, poses: npt.ArrayLike) -> 'Poses':
        """
        Return an array of poses as one of this class; the memory is shared.

        :param poses: (..., 7), metres and unit quaternions x y z w.
        :raises ValueError: another shape.
        """
        array = np.asarray(poses, dtype=float)
        if array.shape[-1:] != (7,):
            raise ValueError(f'poses are (..., 7), not {array.shape}')
        made = array.view(cls)
        made._has_rows = True
        return made

    @property
    def translation(self) -> Array:
        """Return the origins of the source frame in the target frame, (N, 3), metres."""
        return self._rows()[..., :3]

    @property
    def rotation(self) -> Array:
        """Return the unit quaternions, (N, 4), x y z w."""
        return self._rows()[..., 3:]

    def inverse(self) -> 'Poses':
        """Return b_T_a of every a_T_b."""
        return Poses(se3.inverse_many(self._rows()))

    def as_matrix(self) -> Array:
        """Return the homogeneous matrices, (N, 4, 4)."""
        return se3.as_matrix_many(self._rows())

    def _rows(self) -> Array:
        if not self._has_rows:
            raise ValueError(_NO_ROWS)
        return np.asarray(self)

    def __matmul__(self, other: Any) -> Any:
        return product(self._rows(), other) if self._has_rows else np.asarray(self) @ other

    def __rmatmul__(self, other: Any) -> Any:
        return product(poses_of(other), self._rows())

    def __getitem__(self, key: Any) -> Any:
        part = np.asarray(self)[key]
        # A tuple, or a mask of all numbers, may select some of the seven columns.
        keeps_rows = self._has_rows and self.ndim > 1 and not isinstance(key, tuple) and (
            np.ndim(key) < 2)
        return Poses(part) if keeps_rows and isinstance(part, np.ndarray) else part

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if ufunc is np.matmul and method == '__call__' and not options:
            left, right = inputs
            return left.__matmul__(right) if isinstance(left, Poses) else (
                right.__rmatmul__(left))
        return as_plain(ufunc, method, inputs, options)

    def __reduce__(self) -> Any:
        plain = np.array(self)
        return (Poses, (plain,)) if self._has_rows else plain.__reduce__()

    def copy(self, order: Any = 'C') -> Any:
        """Return a copy, which consists of poses if this array does."""
        plain = np.array(self, order=order)
        return Poses(plain) if self._has_rows else plain

    def __copy__(self) -> Any:
        return self.copy()

    def __deepcopy__(self, _: Any) -> Any:
        return self.copy()


def as_plain(ufunc: Any, method: str, inputs: Any, options: dict[str, Any]) -> Any:
    """Return the result of a numpy function for inputs with poses converted to plain arrays."""
    if 'out' in options:
        options['out'] = tuple(map(_plain, options['out']))
    return getattr(ufunc, method)(*map(_plain, inputs), **options)


def _plain(given: Any) -> Any:
    if isinstance(given, np.ndarray):
        return given.view(np.ndarray)
    return np.array(given) if isinstance(given, tuple) else given


def product(a_T_b: Array, other: Any) -> Any:
    """
    Return the product of poses (..., 7) and the right operand of ``@``.

    :return: ``Poses`` for poses, and points (..., 3) for points.
    :raises ValueError: the operand is neither, or there is not one for each pose.
    """
    array = array_of(other)
    shape = None if array is None else array.shape
    if array is None or shape is None or not (
            shape[-1:] in ((3,), (7,)) or shape[-2:] == (4, 4)):
        raise ValueError(_refusal(other, shape))
    try:
        if shape[-1] == 3:
            return se3.apply_many(a_T_b, array)
        return Poses(se3.compose_many(a_T_b, _sevens(array)))
    except ValueError as error:
        if 'broadcast' not in str(error):
            raise
        raise ValueError(
            f'{a_T_b.shape} poses and {shape} do not match: pass one for each pose, or one for '
            'all') from None


def poses_of(given: Any) -> Array:
    """
    Return the left operand of ``@`` as poses (..., 7).

    :raises ValueError: not a pose, or a matrix that is not a rigid transform.
    """
    array = array_of(given)
    if array is None or not (array.shape[-1:] == (7,) or array.shape[-2:] == (4, 4)):
        shape = '' if array is None else f' of the shape {array.shape}'
        raise ValueError('the left operand of @ must be poses (..., 7) or matrices (..., 4, 4), '
                         f'not a {type(given).__name__}{shape}')
    return _sevens(array)


def _sevens(array: Array) -> Array:
    return array if array.shape[-1] == 7 else se3.from_matrix_many(array)


def _refusal(other: Any, shape: tuple[int, ...] | None) -> str:
    if shape is not None and shape[-1:] == (4,):
        return (f'{_WHAT}. The shape {shape} is that of homogeneous points: pass their first '
                'three numbers, points[..., :3]')
    had = f'a {type(other).__name__}' if shape is None else f'the shape {shape}'
    return f'{_WHAT}, and not {had}'


# --- one pose

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
