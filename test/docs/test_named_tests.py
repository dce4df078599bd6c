# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tests that a page names as evidence exist."""

from itertools import chain
import re

from pages import PAGES, REPOSITORY
import pytest


@pytest.mark.parametrize('page', [page for page in PAGES if page.name != 'CONTRIBUTING.md'],
                         ids=lambda page: page.relative_to(REPOSITORY).as_posix())
def test_named_tests_exist(page):
    files = list((REPOSITORY / 'test').rglob('*.py'))
    defined = {file.stem for file in files} | set(chain.from_iterable(
        re.findall(r'^def (test_\w+)', file.read_text(), re.MULTILINE) for file in files))
    assert not set(re.findall(r'\btest_\w+\b', page.read_text())) - defined
