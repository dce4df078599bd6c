# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Edges that are functions of time instead of samples.

Splines and their fitting, constant twists, and gyroscopes between samples.
"""
