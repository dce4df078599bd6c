# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One pose, or many, with an operator: ``map_T_camera = map_T_base @ base_T_camera``.

``Pose`` is a tuple of seven floats with an operator and names, ``Poses`` owns an array (N, 7).
It is not an ndarray itself: what numpy makes of a subclass keeps its name, but not its product.
All formulas are in ``se3``, whose functions accept a ``Pose`` like any such tuple. Arguments with
many poses are recognised by their shape: (..., 3) are points, (..., 7) poses, (..., 4, 4)
matrices.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
import math
from typing import Any, Literal, NamedTuple, overload

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
import numpy.typing as npt

from . import se3, so3
from .poses import array_of
from .so3 import Array, Quaternion, Vector3
from ..errors import no_truth

_WHAT = ('the right operand of @ must be points (..., 3), poses (..., 7), matrices (..., 4, 4), '
         'or a Rotation or RigidTransform of scipy')
# With these options, the operator @= of an array calls np.matmul.
_OF_IMATMUL = {'axes': [(-2, -1)] * 3}


class Poses(NDArrayOperatorsMixin):
    """
    Poses as ``lookup_many`` returns them: (N, 7), x y z qx qy qz qw.

    ``a_T_b @ b_T_c`` composes, row by row or with one pose for all; ``a_T_b @ b_p`` transforms
    points (N, 3), one for each pose, or one point (3,) for all. Rows stay poses.

    numpy, pandas and matplotlib take it for an array, and it has an array's operators,
    attributes and methods. Their results are plain arrays, for which ``@`` is numpy's product;
    ``Poses(array)`` makes poses of them again. ``np.asarray(poses)`` shares the memory: pass
    that to code that requires an ndarray.
    """

    __slots__ = ('_array',)

    # More than that of a DataFrame, which would otherwise take poses for a list of lists.
    __pandas_priority__ = 5000

    def __init__(self, poses: npt.ArrayLike) -> None:
        """
        Take poses; the memory of an array of floats is shared.

        :param poses: (..., 7), metres and unit quaternions x y z w.
        :raises ValueError: another shape.
        """
        array = np.asarray(poses, dtype=float)
        if array.shape[-1:] != (7,):
            raise ValueError(f'poses are (..., 7), not {array.shape}')
        # A view, because the owner of the array may change its shape.
        self._array = array.view()

    @property
    def translation(self) -> Array:
        """Return the origins of the source frame in the target frame, (N, 3), metres."""
        return self._array[..., :3]

    @property
    def rotation(self) -> Array:
        """Return the unit quaternions, (N, 4), x y z w."""
        return self._array[..., 3:]

    def inverse(self) -> 'Poses':
        """Return b_T_a of every a_T_b."""
        return Poses(se3.inverse_many(self._array))

    def as_matrix(self) -> Array:
        """Return the homogeneous matrices, (N, 4, 4)."""
        return se3.as_matrix_many(self._array)

    def copy(self, order: Literal['C', 'F', 'A', 'K'] = 'C') -> 'Poses':
        """Return a copy, which shares no memory."""
        return Poses(self._array.copy(order))

    __copy__ = copy

    def __reduce__(self) -> 'tuple[type[Poses], tuple[Array]]':
        return Poses, (self._array,)

    def __repr__(self) -> str:
        return 'Poses' + repr(self._array).removeprefix('array')

    # --- products

    def __matmul__(self, other: object) -> Any:
        return product(self._array, other)

    def __rmatmul__(self, other: object) -> 'Poses | Array':
        return product(_poses_of(other), self._array)

    # --- what an array has

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        view = self._array.view()
        return np.asarray(view, dtype) if copy is None else np.array(view, dtype, copy=copy)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: object,
                        **options: Any) -> object:
        return result_of(ufunc, method, inputs, options)

    def __dlpack__(self, **options: Any) -> Any:
        # Without it, PyTorch takes poses for a sequence of sequences, and rounds to float32.
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._array.__dlpack_device__()

    def __getattr__(self, name: str) -> Any:
        # An array's own protocols, whose names have underscores, would pickle or copy an array,
        # and its ``resize`` would leave rows of another length.
        if name.startswith('_') or name == 'resize' or not hasattr(np.ndarray, name):
            raise AttributeError(f"'Poses' object has no attribute {name!r}", name=name, obj=self)
        return getattr(self._array, name)

    def __getitem__(self, key: Any) -> Any:
        part = self._array[key]
        # A tuple, or a mask of all numbers, may select some of the seven columns.
        is_rows = self._array.ndim > 1 and not isinstance(key, tuple) and np.ndim(key) < 2
        return Poses(part) if is_rows else part

    def __setitem__(self, key: Any, value: npt.ArrayLike) -> None:
        self._array[key] = value

    def __len__(self) -> int:
        return len(self._array)

    __bool__ = no_truth

    def __iter__(self) -> 'Iterator[Poses | Array]':
        return (self[i] for i in range(len(self)))

    def __contains__(self, value: object) -> bool:
        return value in self._array

    # Arrays also compare with None and text, which np.equal refuses; and x ** 2 is np.square(x),
    # from which np.power differs in the last bit on some processors.

    def __eq__(self, other: object) -> Any:
        return self._array == _plain(other)

    def __ne__(self, other: object) -> Any:
        return self._array != _plain(other)

    def __pow__(self, other: object) -> Any:
        return self._array ** _plain(other)


def result_of(ufunc: np.ufunc, method: str, inputs: Sequence[object],
              options: dict[str, Any]) -> object:
    """
    Return what a ufunc of numpy makes of poses: a plain array, or the given ``out``.

    ``np.matmul`` is our product.

    :raises TypeError: a ``Pose`` as ``out``, or ``np.matmul`` with another option.
    """
    outs = options.pop('out', ())
    if any(isinstance(out, Pose) for out in outs):
        raise TypeError('a Pose never changes: pass an array as out')
    if ufunc is np.matmul and method == '__call__':
        if options not in ({}, _OF_IMATMUL):
            raise TypeError('for poses, np.matmul has no option but out')
        made = _matmul(*inputs)
        for out in outs:
            np.asarray(out)[...] = made
    else:
        if outs:
            options['out'] = tuple(map(_plain, outs))
        made = getattr(ufunc, method)(*map(_plain, inputs), **options)
    # Not the memory of ``out``: after `poses += 1`, the name still stands for poses.
    if len(outs) > 1:
        return tuple(part if out is None else out for out, part in zip(outs, made, strict=True))
    return outs[0] if outs else made


def _matmul(left: object, right: object) -> 'Pose | Poses | Array':
    made = product(_poses_of(left), right)
    return _as_one(made) if isinstance(left, Pose) or isinstance(right, Pose) else made


def _plain(given: object) -> object:
    if isinstance(given, Poses):
        return given._array
    return np.array(given) if isinstance(given, Pose) else given


def product(a_T_b: Array, other: object) -> Poses | Array:
    """
    Return the product of poses (..., 7) and the right operand of ``@``.

    :return: ``Poses`` for poses, and points (..., 3) for points.
    :raises ValueError: the operand is neither, or there is not one for each pose.
    """
    array = array_of(other)
    if array is None or not (array.shape[-1] in (3, 7) or array.shape[-2:] == (4, 4)):
        raise ValueError(_refusal(other, array))
    try:
        if array.shape[-1] == 3:
            return se3.apply_many(a_T_b, array)
        return Poses(se3.compose_many(a_T_b, _sevens(array)))
    except ValueError as error:
        if 'broadcast' not in str(error):
            raise
        raise ValueError(
            f'{a_T_b.shape} poses and {array.shape} do not match: pass one for each pose, or one '
            'for all') from None


def _poses_of(given: object) -> Array:
    """
    Return the left operand of ``@`` as poses (..., 7).

    :raises ValueError: not a pose, or a matrix that is not a rigid transform.
    """
    array = array_of(given)
    if array is None or not (array.shape[-1] == 7 or array.shape[-2:] == (4, 4)):
        shape = '' if array is None else f' of the shape {array.shape}'
        raise ValueError('the left operand of @ must be poses (..., 7) or matrices (..., 4, 4), '
                         f'not a {type(given).__name__}{shape}')
    return _sevens(array)


def _sevens(array: Array) -> Array:
    return array if array.shape[-1] == 7 else se3.from_matrix_many(array)


def _refusal(other: object, array: Array | None) -> str:
    if array is None:
        return f'{_WHAT}, and not a {type(other).__name__}'
    if array.shape[-1] == 4:
        return (f'{_WHAT}. The shape {array.shape} is that of homogeneous points: pass their '
                'first three numbers, points[..., :3]')
    return f'{_WHAT}, and not the shape {array.shape}'


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
    def __matmul__(self, other: npt.NDArray[np.generic] | Sequence[Any]) -> Array: ...

    def __matmul__(self, other: object) -> object:
        if isinstance(other, Pose):
            return Pose(*se3.compose(self, other))
        return _as_one(product(np.array(self), other))

    def __rmatmul__(self, other: object) -> 'Pose | Poses | Array':
        return _as_one(product(_poses_of(other), self))

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: object,
                        **options: Any) -> object:
        # Otherwise numpy would treat the pose in `array @ pose` as a vector of seven.
        return result_of(ufunc, method, inputs, options)

    def __str__(self) -> str:
        # Adding zero changes -0.0 to 0.0.
        x, y, z = (round(value, 3) + 0.0 for value in self.translation)
        roll, pitch, yaw = (round(math.degrees(angle), 2) + 0.0 for angle in self.as_rpy())
        return f'({x:.3f}, {y:.3f}, {z:.3f}) m, rpy ({roll:.2f}, {pitch:.2f}, {yaw:.2f}) deg'


def _as_one(result: Poses | Array) -> Pose | Poses | Array:
    """Return a single pose as a ``Pose``, and anything else unchanged."""
    return Pose(*result.tolist()) if isinstance(result, Poses) and result.ndim == 1 else result


pose_of: Callable[[se3.PoseTuple], Pose] = partial(tuple.__new__, Pose)
"""Return a tuple of seven numbers as a ``Pose``, unchecked, in less time than ``Pose._make``."""
