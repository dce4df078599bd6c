# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The labs over DDS: only these import rclpy.

All other labs run without ROS.
"""
