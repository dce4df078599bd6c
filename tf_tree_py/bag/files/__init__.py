# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Messages out of files of any kind, intact or damaged.

The contents of the messages are not interpreted here.
"""
