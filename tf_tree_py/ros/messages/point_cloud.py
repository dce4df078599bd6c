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

from geometry_msgs.msg import Transform, TransformStamped
import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.scans import CODES, float_columns, POINT, scan_points
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.geometry.so3 import Array

from .fast_messages import copy_of, maker
from .geometry import transform_values

_NORMAL = ('normal_x', 'normal_y', 'normal_z')

_DATATYPES = {code: datatype for datatype, code in CODES.items()}

# Points per block: all arrays of one block fit into the cache of a CPU core.
BLOCK = 8192

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
        _apply(moved, _NORMAL, np.column_stack([a_R_b, (0.0, 0.0, 0.0)]))
    return moved


def transform_points(point_cloud: npt.ArrayLike, transform: Transform | TransformStamped) -> Array:
    """Return points (N, 3) in the transform's target frame, in doubles."""
    return se3.apply_many(transform_values(getattr(transform, 'transform', transform)),
                          point_cloud)


def _apply(cloud: PointCloud2, names: Sequence[str], matrix: Array) -> None:
    """Replace (x, y, z) of three fields by the matrix (3, 4) times (x, y, z, 1), in place."""
    columns = float_columns(cloud, names)
    given, moved = np.ones((4, BLOCK)), np.empty((3, BLOCK))
    # No warnings where an infinity becomes NaN, or a number too large for float32 an infinity.
    with np.errstate(invalid='ignore', over='ignore'):
        for row in zip(*columns, strict=True):
            for begin in range(0, len(row[0]), BLOCK):
                block = [column[begin:begin + BLOCK] for column in row]
                count = len(block[0])
                for number, values in enumerate(block):
                    given[number, :count] = values
                np.matmul(matrix, given[:, :count], out=moved[:, :count])
                for number, values in enumerate(block):
                    values[:] = moved[number, :count]


# --- making


def copy_of_cloud(cloud: PointCloud2, header: Header) -> PointCloud2:
    """Return a copy of a cloud, with a copy of another header."""
    data = array('B')
    data.frombytes(cloud.data)
    fields = [_field(field.name, field.offset, field.datatype, field.count)
              for field in cloud.fields]
    return _cloud(copy_of(header), cloud.height, cloud.width, fields, cloud.is_bigendian,
                  cloud.point_step, cloud.row_step, data, cloud.is_dense)


def packed_cloud(header: Header, columns: Mapping[str, npt.NDArray[np.generic]],
                 is_dense: bool) -> PointCloud2:
    """
    Return an unorganised cloud of columns (N,), packed, in the machine's byte order.

    :param columns: by field name, of types that a PointField supports.
    """
    dtype = np.dtype([(name, values.dtype) for name, values in columns.items()])
    points = np.empty(len(next(iter(columns.values()))), dtype)
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
    points = scan_points(scan)
    valid = np.isfinite(points[:, 0])
    columns: dict[str, npt.NDArray[np.generic]] = dict(
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
    points = scan_points(scan)
    return points[np.isfinite(points[:, 0])]
