# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a page shows, as plain data.

Its moment, the poses of all frames, and facts about one. This code depends on neither viser nor a
browser.
"""
