# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The blocks of code in a page of the documentation, and their comments for the tests."""

from pathlib import Path
import re
from typing import NamedTuple

REPOSITORY = Path(__file__).resolve().parents[1]

_NOT_RUN = re.compile(r'<!-- not run: (.+) -->')


class Block(NamedTuple):
    """
    One block of code.

    :ivar line: the number of its first line of code.
    :ivar not_run: the reason why the tests do not run it; empty if they do.
    """

    page: str
    line: int
    language: str
    code: str
    not_run: str

    def __str__(self) -> str:
        return f'{self.page}:{self.line}'


def blocks_of(page: Path) -> list[Block]:
    """Return the blocks of a page, from top to bottom."""
    found = []
    lines = page.read_text().splitlines()
    begin = None
    for number, line in enumerate(lines):
        if not line.startswith('```'):
            continue
        if begin is None:
            begin = number
            continue
        said = _NOT_RUN.fullmatch(lines[begin - 1])
        found.append(Block(
            page.relative_to(REPOSITORY).as_posix(), begin + 2, lines[begin][3:],
            '\n'.join(lines[begin + 1:number]) + '\n', said[1] if said else ''))
        begin = None
    assert begin is None, f'{page}:{begin}: a block without an end'
    return found


def program(blocks: list[Block]) -> str:
    """Return the blocks of one page as one program, with the line numbers of the page."""
    lines: list[str] = []
    for block in blocks:
        lines += [''] * (block.line - 1 - len(lines))
        lines += block.code.splitlines()
    return '\n'.join(lines) + '\n'
