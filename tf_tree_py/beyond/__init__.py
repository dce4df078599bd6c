# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What tf2 has not: a room for each feature.

Each room holds all of its feature, and imports the heart; the heart imports none of them.
"""
