# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The labs, experiments of the textbook: each prints numbers and a law, and draws a picture."""
