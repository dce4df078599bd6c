# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
PointCloud2 and LaserScan: the bytes of a cloud, and the points of a scan.

The bytes of a cloud are read, transformed and written in place. Its layout does not change: its
padding, its rows, the order and the types of its fields and its byte order stay, and so do the
values of all other fields. The points of a scan are where its rays were reflected.
"""

from array import array
from collections.abc import Mapping, Sequence
import sys
from typing import Any

from geometry_msgs.msg import Transform, TransformStamped
import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array

from .fast_messages import copy_of, maker
from .geometry import transform_values

POINT = ('x', 'y', 'z')
NORMAL = ('normal_x', 'normal_y', 'normal_z')

# Type codes and byte orders in numpy's notation.
_CODES = {PointField.INT8: 'i1', PointField.UINT8: 'u1', PointField.INT16: 'i2',
          PointField.UINT16: 'u2', PointField.INT32: 'i4', PointField.UINT32: 'u4',
          PointField.FLOAT32: 'f4', PointField.FLOAT64: 'f8'}
_DATATYPES = {code: datatype for datatype, code in _CODES.items()}

# Points per block: all arrays of one block fit into the cache of a CPU core.
_BLOCK = 8192

_cloud, _field = maker(PointCloud2), maker(PointField)


# --- transforming

def do_transform_cloud(cloud: PointCloud2, transform: Transform | TransformStamped,
                       rotate_normals: bool = False) -> PointCloud2:
    """
    Return a cloud in the transform's target frame, its layout and other fields kept.

    It is computed in doubles and rounded once. A point with a NaN or an infinity becomes
    NaN.

    :param transform: a bare ``Transform`` leaves the header as it is.
    :param rotate_normals: rotate normal_x, normal_y and normal_z, too.
    :raises InvalidArgumentException: no x, y and z of a floating type, normals that are requested
        and missing, or a layout that contradicts itself.
    """
    header = transform.header if isinstance(transform, TransformStamped) else cloud.header
    a_T_b = transform_values(getattr(transform, 'transform', transform))
    moved = copy_of_cloud(cloud, header)
    a_R_b = so3.as_matrix(a_T_b[3:])
    _apply(moved, POINT, np.column_stack([a_R_b, a_T_b[:3]]))
    if rotate_normals:
        _apply(moved, NORMAL, np.column_stack([a_R_b, (0.0, 0.0, 0.0)]))
    return moved


def transform_points(point_cloud: npt.ArrayLike,
                     transform: Transform | TransformStamped) -> Array:
    """Return points (N, 3) in the transform's target frame, in doubles."""
    return se3.apply_many(transform_values(getattr(transform, 'transform', transform)),
                          point_cloud)


def _apply(cloud: PointCloud2, names: Sequence[str], matrix: Array) -> None:
    """Replace (x, y, z) of three fields by the matrix (3, 4) times (x, y, z, 1), in place."""
    columns = float_columns(cloud, names)
    given, moved = np.ones((4, _BLOCK)), np.empty((3, _BLOCK))
    # No warnings where an infinity becomes NaN, or a number too large for float32 an infinity.
    with np.errstate(invalid='ignore', over='ignore'):
        for row in zip(*columns, strict=True):
            for begin in range(0, len(row[0]), _BLOCK):
                block = [column[begin:begin + _BLOCK] for column in row]
                count = len(block[0])
                for number, values in enumerate(block):
                    given[number, :count] = values
                np.matmul(matrix, given[:, :count], out=moved[:, :count])
                for number, values in enumerate(block):
                    values[:] = moved[number, :count]


# --- reading and writing


def point_count(cloud: PointCloud2) -> int:
    """Return how many points a cloud has, invalid ones included."""
    return int(cloud.height * cloud.width)


def points_of(cloud: PointCloud2) -> npt.NDArray[Any]:
    """
    Return a copy of the coordinates, row by row.

    :return: (N, 3), float32 or float64 as in the cloud.
    :raises InvalidArgumentException: no x, y and z of a floating type.
    """
    columns = float_columns(cloud, POINT)
    kind = np.result_type(*(column.dtype for column in columns)).newbyteorder('=')
    return np.stack([column.reshape(-1) for column in columns], axis=1, dtype=kind)


def write_points(cloud: PointCloud2, points: npt.NDArray[Any]) -> None:
    """Overwrite the coordinates of a cloud by (N, 3), row by row, in place."""
    for column, values in zip(float_columns(cloud, POINT), points.T, strict=True):
        column[:] = values.reshape(column.shape)


def float_columns(cloud: PointCloud2, names: Sequence[str]) -> list[npt.NDArray[Any]]:
    """
    Return ``field_column`` of several fields, which must have a floating type.

    An empty cloud need not have the fields.
    """
    if point_count(cloud) == 0:
        return [np.empty((0, 0), dtype=np.float32) for _ in names]
    columns = [field_column(cloud, name) for name in names]
    for name, column in zip(names, columns, strict=True):
        if column.dtype.kind != 'f':
            raise InvalidArgumentException(
                f'The field {name!r} of the cloud holds {column.dtype.name}; only FLOAT32 and '
                'FLOAT64 can be transformed')
    return columns


def field_column(cloud: PointCloud2, name: str) -> npt.NDArray[Any]:
    """
    Return a view of one field of all points: writing to it changes the cloud.

    :return: (rows, columns), which is (1, N) if there is no padding between rows.
    :raises InvalidArgumentException: there is no such field, or the message contradicts
        itself about where it is.
    """
    field = next((field for field in cloud.fields if field.name == name), None)
    if field is None:
        names = ', '.join(field.name for field in cloud.fields) or 'none at all'
        raise InvalidArgumentException(
            f'The cloud has no field {name!r}; its fields are: {names}')
    # Some drivers write a count of 0 where they mean 1.
    if field.datatype not in _CODES or field.count > 1:
        raise InvalidArgumentException(
            f'The field {name!r} of the cloud has the datatype {field.datatype} and the count '
            f'{field.count}, and must be one number of a type from 1 to 8')
    kind = np.dtype(_CODES[field.datatype]).newbyteorder('>' if cloud.is_bigendian else '<')
    if field.offset + kind.itemsize > cloud.point_step:
        raise InvalidArgumentException(
            f'The field {name!r} of the cloud begins at byte {field.offset} and does not fit '
            f'into a point of {cloud.point_step} bytes')
    rows, columns, row_step = _grid(cloud)
    return np.ndarray((rows, columns), kind, cloud.data, field.offset,
                      (row_step, cloud.point_step))


def _grid(cloud: PointCloud2) -> tuple[int, int, int]:
    """Return rows, columns, and bytes from row to row; one row where there is no padding."""
    height, width, point_step = cloud.height, cloud.width, cloud.point_step
    row_step = width * point_step if height == 1 else cloud.row_step
    if row_step < width * point_step or len(cloud.data) < (height - 1) * row_step + (
            width * point_step):
        raise InvalidArgumentException(
            f'The cloud declares {height} x {width} points of {point_step} bytes, in '
            f'rows of {cloud.row_step} bytes, and has {len(cloud.data)} bytes of data')
    if row_step == width * point_step:
        return 1, height * width, row_step
    return height, width, row_step


# --- making


def copy_of_cloud(cloud: PointCloud2, header: Header) -> PointCloud2:
    """Return a copy of a cloud, with a copy of another header."""
    data = array('B')
    data.frombytes(cloud.data)
    fields = [_field(field.name, field.offset, field.datatype, field.count)
              for field in cloud.fields]
    return _cloud(copy_of(header), cloud.height, cloud.width, fields, cloud.is_bigendian,
                  cloud.point_step, cloud.row_step, data, cloud.is_dense)


def packed_cloud(header: Header, columns: Mapping[str, npt.NDArray[Any]],
                 is_dense: bool) -> PointCloud2:
    """
    Return an unorganised cloud of columns (N,), packed, in the machine's byte order.

    :param columns: by field name, of types that a PointField supports.
    """
    kind = np.dtype([(name, values.dtype) for name, values in columns.items()])
    points = np.empty(len(next(iter(columns.values()))), kind)
    fields, offset = [], 0
    for name, values in columns.items():
        points[name] = values
        fields.append(_field(name, offset, _DATATYPES[values.dtype.str[1:]], 1))
        offset += values.dtype.itemsize
    data = array('B')
    data.frombytes(points.tobytes())
    return _cloud(copy_of(header), 1, len(points), fields, sys.byteorder == 'big',
                  offset, offset * len(points), data, is_dense)


# --- scans

def as_cloud(scan: LaserScan, keep_invalid: bool = False) -> PointCloud2:
    """
    Return a scan as a cloud in its own frame.

    Fields: x, y, z (FLOAT32); intensity (FLOAT32) if the scan has one for each ray; time (FLOAT32,
    seconds after the header's stamp) if its rays were not taken at once, so that ``deskew_cloud``
    can use it.

    A ray is valid if range_min <= range <= range_max, as the message defines it. NaN (an error)
    and +-inf (nothing seen, or too close: REP 117) are not.

    :param keep_invalid: keep invalid rays, too, as NaN, so that the n-th point is the n-th ray.
    """
    points = _points(scan)
    valid = np.isfinite(points[:, 0])
    columns: dict[str, npt.NDArray[Any]] = dict(
        zip(('x', 'y', 'z'), points.T.astype(np.float32), strict=True))
    if len(scan.intensities) == len(points):
        columns['intensity'] = np.array(scan.intensities, dtype=np.float32)
    if scan.time_increment:
        times = np.arange(len(points)) * float(scan.time_increment)
        columns['time'] = times.astype(np.float32)
    if not keep_invalid:
        columns = {name: values[valid] for name, values in columns.items()}
    return packed_cloud(scan.header, columns, is_dense=not keep_invalid or bool(valid.all()))


def points_of_scan(scan: LaserScan) -> npt.NDArray[np.float64]:
    """Return the points of the valid rays: (N, 3), in the scan's frame; see ``as_cloud``."""
    points = _points(scan)
    return points[np.isfinite(points[:, 0])]


def _points(scan: LaserScan) -> npt.NDArray[np.float64]:
    """Return the end point of each ray: (N, 3), NaN where it is invalid."""
    given = np.array(scan.ranges, dtype=np.float32)
    # Both in single precision: otherwise a range of exactly range_max would not count.
    valid = (np.float32(scan.range_min) <= given) & (given <= np.float32(scan.range_max))
    valid &= np.isfinite(given)
    ranges = np.where(valid, given, np.nan)
    angles = scan.angle_min + np.arange(len(ranges)) * float(scan.angle_increment)
    return np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0.0 * ranges], axis=1)
