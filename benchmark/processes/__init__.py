# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Programs that run in separate processes: publishers, subscribers, and memory tests."""
