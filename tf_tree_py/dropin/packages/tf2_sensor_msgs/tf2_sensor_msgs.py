# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_sensor_msgs.tf2_sensor_msgs."""

import sensor_msgs.msg
from sensor_msgs.msg import PointCloud2
from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.dropin.installed_tf2 import from_msg_msg, register, to_msg_msg
from tf_tree_py.ros.messages.point_cloud import do_transform_cloud, transform_points

__all__ = ['do_transform_cloud', 'from_msg_msg', 'PointCloud2', 'to_msg_msg', 'transform_points',
           *star(__name__)]

register(sensor_msgs.msg)
