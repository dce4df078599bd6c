# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The structure of the tree, the paths in it, and the lookups.

Also snapshots, and companions: data beside the samples. Nothing here waits for
data.
"""
