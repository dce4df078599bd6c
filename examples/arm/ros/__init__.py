# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The arm as three ROS processes and one process without ROS.

``hardware`` uses PyBullet and no ROS, the others use ROS and no PyBullet, so they may run in
different Pythons. A pipe connects them, and ``wire`` defines its messages.
"""
