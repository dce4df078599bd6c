# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages as numpy arrays."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from geometry_msgs.msg import (
    Polygon,
    PolygonInstance,
    PolygonInstanceStamped,
    PolygonStamped,
    Pose as PoseMessage,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Transform,
    TransformStamped,
)
from nav_msgs.msg import Odometry, Path
import numpy as np
import numpy.typing as npt
from sensor_msgs.msg import LaserScan, PointCloud2
from tf_tree_py.beyond.motion.scans import points_of
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array

from .geometry import points_array, pose_values, transform_values
from .point_cloud import points_of_scan

Values = TypeVar('Values')

_POSES: Mapping[type, Callable[[Any], se3.PoseTuple]] = {
    Transform: transform_values,
    TransformStamped: lambda message: transform_values(message.transform),
    PoseMessage: pose_values,
    PoseStamped: lambda message: pose_values(message.pose),
    PoseWithCovariance: lambda message: pose_values(message.pose),
    PoseWithCovarianceStamped: lambda message: pose_values(message.pose.pose),
    Odometry: lambda message: pose_values(message.pose.pose),
    Pose: lambda pose: pose,
}

_POINTS: Mapping[type, Callable[[Any], npt.NDArray[np.floating]]] = {
    Polygon: lambda message: points_array(message.points),
    PolygonStamped: lambda message: points_array(message.polygon.points),
    PolygonInstance: lambda message: points_array(message.polygon.points),
    PolygonInstanceStamped: lambda message: points_array(message.polygon.polygon.points),
    PoseArray: lambda message: points_array([pose.position for pose in message.poses]),
    Path: lambda message: points_array([pose.pose.position for pose in message.poses]),
    LaserScan: points_of_scan,
    PointCloud2: points_of,
}


def as_matrix(transform: object) -> Array:
    """
    Return a transform or a pose as a homogeneous matrix.

    :param transform: a ``Transform``, a ``Pose`` (the message, or this package's), or a
        message that holds one of them.
    :return: (4, 4)
    :raises TypeError: something else.
    """
    return se3.as_matrix(_read(_POSES, transform))


def as_points(message: object) -> npt.NDArray[Any]:
    """
    Return the points of a message as a new array.

    These are the positions of a ``Path`` or ``PoseArray``, the corners of a ``Polygon``, all
    points of a ``PointCloud2``, row by row, and the valid points of a ``LaserScan``.

    :return: (N, 3) metres; float64, or float32 for a cloud with such fields.
    :raises TypeError: something else.
    """
    return _read(_POINTS, message)


def _read(table: Mapping[type, Callable[[Any], Values]], message: object) -> Values:
    if type(message) not in table:
        names = ', '.join(cls.__name__ for cls in table)
        raise TypeError(f'{type(message).__name__} is none of {names}')
    return table[type(message)](message)
