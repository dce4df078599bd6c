# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses that know their frames.

They compose only if the inner names are equal. Plain poses have no names, and cost less.
"""
