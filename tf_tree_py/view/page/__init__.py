# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
One page: its scene and panels put together.

The rooms below compute what it shows. ``serving`` has the list of open pages.
"""
