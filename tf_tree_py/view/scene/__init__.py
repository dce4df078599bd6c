# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The three-dimensional part of a page, drawn by viser.

``model``, ``robot``, ``framing`` and ``sensors`` compute what to draw.
"""
