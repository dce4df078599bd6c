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

"""The site is made without a warning, no link in it is dead, and its reference is complete."""

import ast
from html.parser import HTMLParser
import os
from pathlib import Path
import re
import subprocess
from urllib.parse import unquote, urldefrag, urlsplit
import zlib

from pages import PAGES, REPOSITORY
import pytest

WORKSPACE = Path(os.environ.get('TF_TREE_PY_WORKSPACE', REPOSITORY / '.workspace'))
PACKAGES = ['tf_tree_py', 'tf_tree_py.core', 'tf_tree_py.bag', 'tf_tree_py.urdf',
            'tf_tree_py.fleet']

# What a browser loads by itself, and does not only lead to.
_LOADED = {('img', 'src'), ('link', 'href'), ('script', 'src'), ('source', 'src')}


class Html(HTMLParser):
    """What a page leads to, what it loads, and where one may land on it."""

    def __init__(self, file):
        super().__init__()
        self.links, self.loads, self.anchors = set(), set(), {''}
        self.feed(file.read_text())

    def handle_starttag(self, tag, attributes):
        """Take in an element."""
        for name, value in attributes:
            if name == 'id':
                self.anchors.add(value)
            elif (tag, name) in _LOADED and dict(attributes).get('rel') != 'canonical':
                self.loads.add(value)
            elif name == 'href':
                self.links.add(value)


@pytest.fixture(scope='module')
def site():
    """Return the folder of the site, made anew."""
    if not (WORKSPACE / 'docs' / '.stamp').exists():
        pytest.skip('what makes the site is not here: scripts/setup --docs')
    done = subprocess.run([REPOSITORY / 'scripts' / 'docs'], text=True, check=False, timeout=240,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout
    return WORKSPACE / 'site'


@pytest.fixture(scope='module')
def pages(site):
    """Return every page of the site, by its file."""
    return {file: Html(file) for file in site.rglob('*.html')}


@pytest.fixture(scope='module')
def described(site):
    """Return the names that the reference describes, as other sites read them."""
    *_, packed = (site / 'objects.inv').read_bytes().split(b'\n', 4)
    return {line.split(' ')[0] for line in zlib.decompress(packed).decode().splitlines()}


def test_every_document_is_a_page(site, pages):
    for page in PAGES:
        name = page.relative_to(REPOSITORY).with_suffix('.html')
        assert site / ('index.html' if page.name == 'README.md' else name) in pages


def test_no_link_is_dead(pages):
    dead = [f'{file}: {link}' for file, page in pages.items() if file.name != '404.html'
            for link in page.links | page.loads if _is_dead(file, link, pages)]
    assert not dead


def _is_dead(file, link, pages):
    if urlsplit(link).scheme:
        return False  # another site's
    path, anchor = urldefrag(unquote(link))
    target = Path(os.path.normpath(file.parent / path)) if path else file
    target = target / 'index.html' if target.is_dir() else target
    return not target.exists() or (target in pages and anchor not in pages[target].anchors)


def test_a_page_loads_nothing_from_other_servers(site, pages):
    assert not {load for page in pages.values() for load in page.loads if urlsplit(load).netloc}
    assert not [sheet for sheet in site.rglob('*.css')
                if re.search(r'(url\(|@import)\s*["\']?(https?:)?//', sheet.read_text())]


@pytest.mark.parametrize('package', PACKAGES)
def test_reference_describes_every_public_name(described, package):
    source = REPOSITORY.joinpath(*package.split('.'), '__init__.py').read_text()
    names, = (ast.literal_eval(node.value) for node in ast.parse(source).body
              if isinstance(node, ast.Assign) and node.targets[0].id == '__all__')
    assert not [name for name in names if f'{package}.{name}' not in described]


def test_reference_describes_what_documents_name(described):
    named = {name for page in PAGES
             for name in re.findall(r'`(tf_tree_py[.\w]+)', page.read_text())}
    assert len(named) > 5 and not named - described


def test_reference_has_the_fields_of_records(described):
    fields = {'tf_tree_py.Pose.qw', 'tf_tree_py.core.Kind.LOOP', 'tf_tree_py.urdf.Box.size'}
    assert fields <= described


def test_fields_of_docstrings_are_laid_out(site):
    left = re.compile(r':(param \w+|ivar \w+|return|raises \w+):')
    assert not [page for page in (site / 'api').glob('*.html') if left.search(page.read_text())]
