# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The subscriptions and publishers of /tf and /tf_static.

The stored samples are in the buffer.
"""
