# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Edges that several sources publish, and the choice of one.

Duplicate publishers that nobody asked for are in ``health``.
"""
