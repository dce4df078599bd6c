# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The site builds without a warning, has no dead link, and its reference is complete."""

import ast
from html.parser import HTMLParser
import json
import os
from pathlib import Path
import re
import shutil
import subprocess
from urllib.parse import unquote, urldefrag, urlsplit
import zlib

from code_blocks import REPOSITORY
from pages import PAGES
from programs import PATIENCE_S
import pytest

WORKSPACE = Path(os.environ.get('TF_TREE_PY_WORKSPACE', REPOSITORY / '.workspace'))
PACKAGES = ['tf_tree_py', 'tf_tree_py.core', 'tf_tree_py.bag', 'tf_tree_py.urdf',
            'tf_tree_py.fleet']

# What a user searches for, and the page that comes first.
FOUND_FIRST = {
    'remap tf topic': 'docs/several_robots.html',
    'covariance': 'docs/uncertainty.html',
    'timeout': 'docs/waiting.html',
    'install without ros': 'docs/installing.html',
    'lookup_transform': 'api/tf_tree_py.Buffer.html'}

# Elements that a browser loads by itself, unlike links.
_LOADED = {('img', 'src'), ('link', 'href'), ('script', 'src'), ('source', 'src')}


class Html(HTMLParser):
    """The links, the loaded files and the anchors of a page."""

    def __init__(self, file):
        super().__init__()
        self.links, self.loads, self.anchors = set(), set(), {''}
        self.feed(file.read_text())

    def handle_starttag(self, tag, attributes):
        """Record an element."""
        for name, value in attributes:
            if name == 'id':
                self.anchors.add(value)
            elif (tag, name) in _LOADED and dict(attributes).get('rel') != 'canonical':
                self.loads.add(value)
            elif name == 'href':
                self.links.add(value)


@pytest.fixture(scope='module')
def site():
    """Return the folder of the newly built site."""
    if not (WORKSPACE / 'docs' / '.stamp').exists():
        pytest.skip('what makes the site is not here: scripts/setup --docs')
    done = subprocess.run([REPOSITORY / 'scripts' / 'docs'], text=True, check=False,
                          timeout=4 * PATIENCE_S, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout
    return WORKSPACE / 'site'


@pytest.fixture(scope='module')
def pages(site):
    """Return every page of the site, by its file."""
    return {file: Html(file) for file in site.rglob('*.html')}


@pytest.fixture(scope='module')
def described(site):
    """Return the names in the reference, in the inventory for other sites."""
    *_, packed = (site / 'objects.inv').read_bytes().split(b'\n', 4)
    return {line.split(' ')[0] for line in zlib.decompress(packed).decode().splitlines()}


def test_search_finds_the_page_first(site):
    if shutil.which('node') is None:
        pytest.skip('node is not here')
    # One process for all searches, because it makes the index of the words.
    found = subprocess.run(['node', Path(__file__).with_name('search.cjs'), site, *FOUND_FIRST],
                           capture_output=True, text=True, check=True, timeout=PATIENCE_S).stdout
    first = [pages[0] for pages in json.loads(found)]
    assert dict(zip(FOUND_FIRST, first, strict=True)) == FOUND_FIRST


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
        return False  # of another site
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
