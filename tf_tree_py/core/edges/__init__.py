# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The history of one edge: samples and their interpolation, or one pose.

Also its copy for lookups at many stamps. The tree defines which edges exist.
"""
