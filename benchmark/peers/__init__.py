# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The contestants. This file imports nothing: one of them runs in another Python."""
