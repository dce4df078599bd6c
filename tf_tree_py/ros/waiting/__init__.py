# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Timeouts by a ROS clock, and futures, without a thread for each wait.

``core.buffer`` decides when a lookup has an answer.
"""
