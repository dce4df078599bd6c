# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A tree with a lock: insertion, and waiting for an answer.

``tree`` stores the edges and computes the answers.
"""
