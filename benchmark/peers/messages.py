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

"""ROS 2's ``TransformStamped``, built the public way."""

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

from ..motion import Edge, Pose


def transform_stamped(edge: Edge, stamp: int, pose: Pose) -> TransformStamped:
    """Return a transform as a message."""
    x, y, z, qx, qy, qz, qw = pose
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return TransformStamped(
        header=Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=edge.parent),
        child_frame_id=edge.child,
        transform=Transform(translation=Vector3(x=x, y=y, z=z),
                            rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)))


def pose_of(message: TransformStamped) -> Sequence[float]:
    """Return the seven numbers of a message."""
    t, q = message.transform.translation, message.transform.rotation
    return t.x, t.y, t.z, q.x, q.y, q.z, q.w
