# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The transform tree on ROS 2: needs rclpy, geometry_msgs and tf2_msgs.

The names that users need are in ``tf_tree_py``, which loads them on first use. Nothing is imported
here, because each import costs the time of all message types it uses.
"""
