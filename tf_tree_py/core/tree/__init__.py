# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The structure of the tree, the paths between frames, and the lookups.

Nothing here waits for data.
"""
