# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The samples of one edge over time, in the kinds of history.

Also how each kind is stored in a file, and copied for lookups at many stamps. The tree defines
which edges exist.
"""
