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

"""Names of tf2_sensor_msgs.tf2_sensor_msgs."""

import sensor_msgs.msg
from sensor_msgs.msg import PointCloud2
from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401
from tf_tree_py.dropin.installed_tf2 import from_msg_msg, register, to_msg_msg
from tf_tree_py.ros.messages.point_cloud import do_transform_cloud, transform_points

__all__ = ['do_transform_cloud', 'from_msg_msg', 'PointCloud2', 'to_msg_msg', 'transform_points']

register(sensor_msgs.msg)
