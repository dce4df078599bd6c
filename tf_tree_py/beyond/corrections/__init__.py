# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses that a localiser corrects: jumps that are spread over time, and anchors of maps.

The samples as they arrived can be restored.
"""
