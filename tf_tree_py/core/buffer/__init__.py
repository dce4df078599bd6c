# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A tree with a lock: inserting transforms, and waiting until a lookup can succeed.

``tree`` stores the edges and computes the answers.
"""
