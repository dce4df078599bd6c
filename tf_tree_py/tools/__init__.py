# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Executables with which a person inspects a tree.

Live, from a bag, or from a fleet. Their results are computed below; executables that keep running
are in ``nodes``.
"""
