# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The speed of tf_tree_py and its peers, measured in one run: ``scripts/bench``.

This is not a test: nothing asserts a speed. The results of all contestants are compared
before the contestants are timed.
"""
