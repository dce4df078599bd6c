# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Edges that are functions of time instead of samples: splines, constant twists, gyroscopes.

Splines are fitted here, too.
"""
