# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Builds ``tf2_msgs``, which the wheels of ROS 2 do not contain.

``python -m tf_tree_py.interfaces`` builds it into the environment that runs it. Installations
of ROS 2 from its packages contain tf2_msgs, and do not need this. No ROS is imported.
"""
