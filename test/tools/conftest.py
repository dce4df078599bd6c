# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Real rclpy over real DDS, on this machine and this process's domain only."""

from domains import isolate

isolate()
