# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One tree for all processes of a machine, in shared memory.

One process receives the transforms and writes them, and all others look up in the same memory. No
ROS is needed. Nothing but samples and static transforms is shared.
"""
