# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Twists, trajectories and deskewing, from many lookups.

Nothing here is stored in a buffer.
"""
