# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Rotations and poses, as formulas for floats and for arrays.

They are independent of frames and time.
"""
