# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Covariances of edges, and the uncertainty of lookups.

Covariances of poses from callers are checked here, too.
"""
