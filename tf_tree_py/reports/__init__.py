# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A buffer's content and use, as data and as text.

Explanations, the audit, drawings, and tf2's formats. Nothing here changes a buffer.
"""
