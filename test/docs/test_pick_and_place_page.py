# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page about pick and place quotes the program literally."""

from code_blocks import REPOSITORY
from pages import BLOCKS
import pytest

PAGE = 'docs/pick_and_place.md'
SOURCES = [path.read_text() for path in (REPOSITORY / 'examples' / 'arm').glob('*.py')]
OWN = [block for block in BLOCKS if block.page == PAGE]
QUOTES = [block for block in OWN if block.language == 'text' and block.code.startswith('    ')]
CHANGES = [block for block in OWN if block.language == 'diff']


def test_page_quotes_and_changes():
    assert len(QUOTES) == 4 and len(CHANGES) == 3


@pytest.mark.parametrize('block', QUOTES, ids=str)
def test_quote_is_in_the_source(block):
    assert any(block.code in source for source in SOURCES)


@pytest.mark.parametrize('block', CHANGES, ids=str)
def test_what_is_to_be_changed_is_in_the_source(block):
    lines = [line[1:] for line in block.code.splitlines() if line.startswith('-')]
    assert lines
    for line in lines:
        assert any(f'{line}\n' in source for source in SOURCES)
