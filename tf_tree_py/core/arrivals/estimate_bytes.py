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

"""
The bytes of Odometry and PoseWithCovarianceStamped, read without ROS.

Both begin with a header, an Odometry has its child_frame_id behind that, and then come 7
doubles of the pose (translation x y z, rotation x y z w) and 36 of its covariance. What an
Odometry has of the velocity is not read.
"""

from .cursor import cdr_cursor, ros1_cursor
from .estimate import Estimate


def read_estimate(data: bytes, names_its_child: bool, ros1: bool) -> Estimate:
    """
    Return what a message says.

    :param names_its_child: whether it is an Odometry.
    :param ros1: whether these are ROS 1's bytes; else they are CDR.
    :raises WireError: the bytes are no such message.
    """
    cursor = ros1_cursor(data) if ros1 else cdr_cursor(data)
    stamp = cursor.take_stamp()
    parent, _ = cursor.take_string()
    child, _ = cursor.take_string() if names_its_child else ('', None)
    x, y, z, qx, qy, qz, qw = cursor.take_doubles(7).tolist()
    return Estimate(parent, child, stamp, (x, y, z, qx, qy, qz, qw), cursor.take_doubles(36))
