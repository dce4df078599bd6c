# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Messages as plain numbers, and messages in another frame.

Topics and the buffer are elsewhere.
"""
