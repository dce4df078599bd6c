# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Executables that run until they are stopped.

The demo of five frames, static transforms, robots from descriptions, servers and relays.
"""
