# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The faults of a tree: a function for each.

``measures`` computes the numbers that they check; ``doctor`` runs them.
"""
