# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Executables: the demo robot of five frames and its listener, static transforms, servers."""
