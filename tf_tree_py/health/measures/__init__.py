# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The measurements of each edge since its first arrival: rates, delays and steps.

``checks`` judges them.
"""
