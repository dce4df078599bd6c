# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What is computed from many lookups: twists, trajectories, deskewing.

Nothing here is stored in a buffer.
"""
