# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
``tf_view``: a tree in the browser.

``model``, ``robot``, ``framing`` and ``sensors`` compute what a page shows, as plain data.
``scene`` and ``panels`` draw it with viser, and ``page`` connects them.
"""
