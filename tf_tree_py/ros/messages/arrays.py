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

"""Messages as numpy arrays."""

from collections.abc import Callable, Mapping
from typing import Any

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
import numpy.typing as npt
from sensor_msgs.msg import LaserScan, PointCloud2
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.so3 import Array

from .geometry import points_array, pose_values, transform_values
from .laser_scan import points_of_scan
from .point_cloud import points_of

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

_POINTS: Mapping[type, Callable[[Any], Array]] = {
    Polygon: lambda message: points_array(message.points),
    PolygonStamped: lambda message: points_array(message.polygon.points),
    PolygonInstance: lambda message: points_array(message.polygon.points),
    PolygonInstanceStamped: lambda message: points_array(message.polygon.polygon.points),
    PoseArray: lambda message: points_array([pose.position for pose in message.poses]),
    Path: lambda message: points_array([pose.pose.position for pose in message.poses]),
    LaserScan: points_of_scan,
    PointCloud2: points_of,
}


def as_matrix(transform: Any) -> Array:
    """
    Return a transform or a pose as a homogeneous matrix.

    :param transform: a ``Transform``, a ``Pose`` (the message, or this package's), or a
        message that holds one of them.
    :return: (4, 4)
    :raises TypeError: something else.
    """
    return se3.as_matrix(_found(_POSES, transform)(transform))


def as_points(message: Any) -> npt.NDArray[Any]:
    """
    Return the points of a message as a new array.

    Positions of a ``Path`` or ``PoseArray``, corners of a ``Polygon``, all points of a
    ``PointCloud2``, row by row, and those of a ``LaserScan`` that hit something.

    :return: (N, 3) metres; float64, or float32 of a cloud that has them so.
    :raises TypeError: something else.
    """
    points: npt.NDArray[Any] = _found(_POINTS, message)(message)
    return points


def _found(table: Mapping[type, Callable[[Any], Any]], message: Any) -> Callable[[Any], Any]:
    if type(message) not in table:
        names = ', '.join(kind.__name__ for kind in table)
        raise TypeError(f'{type(message).__name__} is none of {names}')
    return table[type(message)]
