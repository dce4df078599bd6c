# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The health of a tree.

The doctor and the monitor. ``core.messages`` decides which samples are refused; other packages
display the findings.
"""
