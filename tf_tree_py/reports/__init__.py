# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reports of a buffer's content and use, as data and as text.

Nothing in this room changes a buffer.
"""
