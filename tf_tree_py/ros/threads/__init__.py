# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Threads and small nodes that a user's callback cannot delay.

They pass messages on without reading their contents.
"""
