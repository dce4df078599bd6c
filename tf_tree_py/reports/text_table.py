# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Cells of text as the lines of a table."""

from collections.abc import Container, Sequence


def as_lines(rows: Sequence[Sequence[str]], right: Container[int],
             rule: bool = False) -> list[str]:
    """
    Return rows as lines with aligned columns.

    :param rows: the headings first; all of one length.
    :param right: the indexes of the columns that are aligned right, such as those of numbers.
    :param rule: whether to write a line of dashes below the headings.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ['  '.join(
        cell.rjust(width) if number in right else cell.ljust(width)
        for number, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip()
        for row in rows]
    if rule:
        lines.insert(1, '  '.join('-' * width for width in widths))
    return lines
