# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A tree made of messages, with summaries of their anomalies.

It decodes similar messages together. Reading the messages, and lookups in the tree, are elsewhere.
"""
