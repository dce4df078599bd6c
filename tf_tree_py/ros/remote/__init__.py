# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Lookups in another process: tf2's action, its server and client.

The lookups themselves are not here: the server calls its buffer.
"""
