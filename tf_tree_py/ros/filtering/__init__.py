# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Messages that are held until their transforms are available.

The buffer runs its lookups, which wait in the same way as those of a future.
"""
