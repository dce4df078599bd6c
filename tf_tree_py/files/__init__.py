# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Trees as files, and files that are written whole or not at all.

The core does not know of it. What a feature adds to a tree has methods ``save`` and ``load``.
"""
