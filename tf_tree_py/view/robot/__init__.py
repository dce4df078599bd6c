# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A robot's links as triangles, and its poses by its description.

The package ``urdf`` reads descriptions. This code depends on neither viser nor a browser.
"""
