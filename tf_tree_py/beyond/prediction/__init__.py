# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Poses after the newest sample, with their uncertainty.

A plain lookup never predicts.
"""
