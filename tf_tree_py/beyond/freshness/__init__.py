# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How old the latest transform is, and may be.

A lookup of the latest returns a pose of any age, as in tf2. With a limit it raises an error that
names the edge that has stopped. Another lookup takes each edge's own newest sample.
"""
