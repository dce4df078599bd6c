# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Executables that a person runs to inspect a tree, live or recorded.

Their results are computed in ``core``; executables that keep running are in ``nodes``.
"""
