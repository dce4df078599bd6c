# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The subscriptions and publishers of /tf and /tf_static.

Also topics of covariances and gyroscopes, and duplicate publishers. The samples are in the buffer.
"""
