# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Twists, trajectories and deskewing, from many lookups.

The points of clouds and scans, and their times, are read here. Nothing is stored in a buffer.
"""
