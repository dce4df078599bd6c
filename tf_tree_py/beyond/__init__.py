# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Features that tf2 does not have, each in a room of its own.

A room contains all of its feature. The rooms import ``core``, which imports none of them.
"""
