# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reading the bytes of Odometry and PoseWithCovarianceStamped without ROS.

Both begin with a header, which child_frame_id follows in an Odometry. Then come 7 doubles of
the pose (translation x y z, rotation x y z w) and 36 of its covariance. The velocity in an
Odometry is not read.
"""

from tf_tree_py.beyond.uncertainty.insertion import EdgeEstimate
from tf_tree_py.core.messages.byte_cursor import cdr_cursor, ros1_cursor


def read_estimate(data: bytes, names_its_child: bool, ros1: bool) -> EdgeEstimate:
    """
    Return the estimate in a message.

    :param names_its_child: whether it is an Odometry.
    :param ros1: whether these are the bytes of ROS 1; otherwise they are CDR.
    :raises WireError: the bytes are not such a message.
    """
    cursor = ros1_cursor(data) if ros1 else cdr_cursor(data)
    stamp = cursor.take_stamp()
    parent, _ = cursor.take_string()
    child, _ = cursor.take_string() if names_its_child else ('', None)
    x, y, z, qx, qy, qz, qw = cursor.take_doubles(7).tolist()
    return EdgeEstimate(parent, child, stamp, (x, y, z, qx, qy, qz, qw), cursor.take_doubles(36))
