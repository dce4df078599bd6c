# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Packages with tf2's names, which only list their imports from ``tf_tree_py``.

This folder itself is added to Python's path (see ``tf_tree_py.dropin``), so that they are imported
by their own names. Do not import from ``tf_tree_py.dropin.packages``.
"""
