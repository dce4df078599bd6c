# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Trajectories from bags: their stamps, and their file formats.

``core`` computes the poses, and ``bag`` reads the bags.
"""
