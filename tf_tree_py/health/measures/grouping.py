# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Groups of successive items."""

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

_Item = TypeVar('_Item')


def grouped(items: Iterable[_Item],
            belongs: Callable[[Sequence[_Item], _Item], bool]) -> list[list[_Item]]:
    """
    Return items in groups of successive ones.

    :param belongs: returns whether an item belongs to the group before it.
    """
    groups: list[list[_Item]] = []
    for item in items:
        if groups and belongs(groups[-1], item):
            groups[-1].append(item)
        else:
            groups.append([item])
    return groups
