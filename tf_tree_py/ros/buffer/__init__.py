# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
tf2's buffer: the core with messages, clocks and timeouts.

The listeners that fill it are in ``topics``.
"""
