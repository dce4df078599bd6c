# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The tests of this folder use only this machine, and this process's domain."""

from domains import isolate

isolate()
