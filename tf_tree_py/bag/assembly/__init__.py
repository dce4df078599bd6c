# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Builds a tree from messages: decodes similar ones together, checks them, and summarizes anomalies.

Reading the messages, and lookups in the tree, are elsewhere.
"""
