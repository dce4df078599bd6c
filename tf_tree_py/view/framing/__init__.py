# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The camera, the sizes of axes, and the places of names.

These are pure functions, without viser and without a browser.
"""
