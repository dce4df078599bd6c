# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Cells of text as the lines of a table."""

from collections.abc import Container, Sequence


def as_lines(rows: Sequence[Sequence[str]], right: Container[int],
             rule: bool = False) -> list[str]:
    """
    Return rows as lines whose columns stand under each other.

    :param rows: the headings first; all of one length.
    :param right: the numbers of the columns that end at the right, as numbers do.
    :param rule: whether a line of dashes stands under the headings.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ['  '.join(
        cell.rjust(width) if number in right else cell.ljust(width)
        for number, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip()
        for row in rows]
    if rule:
        lines.insert(1, '  '.join('-' * width for width in widths))
    return lines
