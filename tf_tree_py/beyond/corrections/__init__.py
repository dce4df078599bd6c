# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses that a localiser corrects, without jumps.

Blends with a bounded speed, and the anchor of a map. The samples as they arrived can be restored.
"""
