# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Conversions between messages and numbers, and messages transformed to another frame.

Topics and the buffer are elsewhere.
"""
