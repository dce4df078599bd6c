# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Edges with several sources, and the choice between them.

``health`` detects publishers that send the same edge by mistake.
"""
