# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Rates, delays, steps and jumps of each edge, and its clock.

They are measured on arrival; ``checks`` judges them.
"""
