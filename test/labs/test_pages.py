# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every lab has its page in the course, and every page has its picture."""

from pathlib import Path
import re

import pytest
from tf_tree_py.labs.catalogue import LABS

DOCS = Path(__file__).parents[2] / 'docs'


@pytest.mark.parametrize('name', LABS)
def test_page_has_its_parts_and_its_pictures(name):
    page = (DOCS / 'labs' / f'{name}.md').read_text()
    headings = re.findall(r'^## (.*)$', page, flags=re.MULTILINE)
    assert headings[-2:] == ['What to remember', 'Exercise'] and 'What to see' in headings
    assert re.search(rf'^tf_lab {name}(  .*)?$', page, flags=re.MULTILINE)
    assert '<summary>Solution</summary>' in page
    pictures = re.findall(r'!\[.+\]\((images/.+\.svg)\)', page)
    assert f'images/{name}.svg' in pictures
    for picture in pictures:
        assert (DOCS / 'labs' / picture).exists()
        assert (DOCS / 'labs' / picture).with_suffix('.png').exists()


def test_index_and_site_have_all_labs_in_the_order_of_the_course():
    linked = re.findall(r'\(labs/(.+)\.md\)', (DOCS / 'index.md').read_text())
    shown = re.findall(r'docs/labs/(.+)\.md', (DOCS.parent / 'mkdocs.yml').read_text())
    assert linked == shown == list(LABS)
