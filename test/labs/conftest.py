# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tests with ROS use only this machine, and this process's domain."""

from importlib.util import find_spec

from domains import isolate

# The labs themselves need no ROS, and neither do most of their tests.
collect_ignore = [] if find_spec('rclpy') else ['test_audit_ros.py', 'test_live.py']

# Before rclpy.init, here and in the processes that tests start; a lab's session has its own.
isolate()
