# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Covariances of edges, and the uncertainty of lookups.

Along a path, of several lookups together, and for large angles; gates for measurements.
Covariances from callers are checked here, and the noise of samples is learnt.
"""
