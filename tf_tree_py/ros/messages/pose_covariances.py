# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Poses with covariances, between messages and plain numbers."""

from typing import NamedTuple

from geometry_msgs.msg import PoseWithCovariance, PoseWithCovarianceStamped
import numpy as np
from rclpy.duration import Duration
from std_msgs.msg import Header
from tf_tree_py.beyond.prediction.prediction import Prediction
from tf_tree_py.beyond.uncertainty.covariances import checked_covariance, composed
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array

from .convert import time_message
from .geometry import pose_message, pose_values


def pose_with_covariance_stamped(frame_id: str, stamp: int, pose: PoseTuple,
                                 covariance: Array) -> PoseWithCovarianceStamped:
    """Return ``frame_T_something`` as a message; its quaternion has w >= 0."""
    return PoseWithCovarianceStamped(
        header=Header(stamp=time_message(stamp), frame_id=frame_id),
        pose=PoseWithCovariance(pose=pose_message(pose),
                                covariance=np.ascontiguousarray(covariance.reshape(36))))


class PredictedPose(NamedTuple):
    """
    A pose that may lie beyond the data.

    :ivar pose: of the source in the target, at the requested time.
    :ivar beyond: how far beyond the newest data of an edge that is; zero if nothing was predicted.
    """

    pose: PoseWithCovarianceStamped
    beyond: Duration


def predicted_pose(frame_id: str, found: Prediction) -> PredictedPose:
    """Return a prediction as a message, and how far beyond the data it is."""
    message = pose_with_covariance_stamped(frame_id, found.stamp, found.pose, found.covariance)
    return PredictedPose(message, Duration(nanoseconds=found.beyond))


def uncertain_values(message: PoseWithCovariance) -> tuple[PoseTuple, Array]:
    """
    Return the seven numbers and the covariance (6, 6) of a message.

    :raises InvalidArgumentException: it has no valid covariance.
    """
    return pose_values(message.pose), checked_covariance(message.covariance)


def composed_with(target_T_source: PoseWithCovarianceStamped, message: PoseWithCovarianceStamped,
                  ) -> PoseWithCovarianceStamped:
    """
    Return a pose in a target frame; its covariance includes that of the transform.

    :param target_T_source: the result of ``Buffer.lookup_uncertain``.
    :raises InvalidArgumentException: one of them has no valid covariance.
    """
    way, of_way = uncertain_values(target_T_source.pose)
    pose, of_pose = uncertain_values(message.pose)
    stamped = pose_with_covariance_stamped(
        target_T_source.header.frame_id, 0, se3.compose(way, pose),
        composed(way, of_way, pose, of_pose))
    stamped.header.stamp = target_T_source.header.stamp
    return stamped
