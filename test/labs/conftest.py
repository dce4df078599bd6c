# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which tests of the labs need ROS."""

from importlib.util import find_spec

# The labs themselves need no ROS, and neither do most of their tests.
collect_ignore = [] if find_spec('rclpy') else ['test_audit_ros.py', 'test_live.py']
