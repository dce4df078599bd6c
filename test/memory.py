# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The memory that objects take."""

import gc
import sys
import types


def bytes_of(*roots):
    """Return the memory of objects and everything that they reference, except code and types."""
    seen, todo, total = set(), list(roots), 0
    while todo:
        each = todo.pop()
        if id(each) in seen or isinstance(each, (type, types.ModuleType, types.FunctionType)):
            continue
        seen.add(id(each))
        total += sys.getsizeof(each)
        todo += gc.get_referents(each)
    return total
