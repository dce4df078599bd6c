# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A release writes files that bloom's own reader accepts."""

from pathlib import Path
import re
import shutil
import sys

from programs import completed
import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
FILES = ('CHANGELOG.md', 'package.xml', 'setup.py')


pytestmark = pytest.mark.filterwarnings('ignore:nodes.Node.traverse:DeprecationWarning')


@pytest.fixture
def tree(tmp_path):
    """Return a folder with a copy of the files that a release changes."""
    for name in FILES:
        shutil.copy(REPOSITORY / name, tmp_path)
    return tmp_path


def release(tree, version):
    return completed(sys.executable, REPOSITORY / 'scripts' / 'packaging' / 'release.py', version,
                     '--folder', tree)


def test_bloom_reads_what_a_release_writes(tree):
    changelog = pytest.importorskip('catkin_pkg.changelog')
    from catkin_pkg.package import parse_package
    from catkin_pkg.package_version import get_forthcoming_label
    from docutils.core import publish_doctree
    done = release(tree, '7.8.9')
    assert done.returncode == 0, done.stderr
    assert parse_package(str(tree)).version == '7.8.9'
    assert "version='7.8.9'," in (tree / 'setup.py').read_text()
    read = changelog.get_changelog_from_path(str(tree), 'tf_tree_py')
    [(version, date, changes)] = list(read.foreach_version())
    assert (version, bool(date)) == ('7.8.9', True)
    written = re.findall('(?m)^(?:- |### )', (tree / 'CHANGELOG.md').read_text())
    assert '\n'.join(map(str, changes)).count('* ') == len(written)
    # The reader raises any mistake in the text, of any severity.
    text = (tree / 'CHANGELOG.rst').read_text()
    publish_doctree(text, settings_overrides={'halt_level': 1})
    assert get_forthcoming_label(text) is None


def test_next_release_keeps_the_last(tree):
    assert release(tree, '7.8.9').returncode == 0
    changes = tree / 'CHANGELOG.md'
    change = '### Fixed\n- A *star* and `a_name_` of a\n  [long page](x.md).\n'
    changes.write_text(changes.read_text().replace(
        '## Unreleased\n', f'## Unreleased\n\n{change}'))
    assert release(tree, '7.9.0').returncode == 0
    text = (tree / 'CHANGELOG.rst').read_text()
    assert text.index('\n7.9.0 (') < text.index('\n7.8.9 (')
    assert '  * A \\*star\\* and ``a_name_`` of a long page.\n' in text


@pytest.mark.parametrize(('version', 'said'), [
    ('v1', 'v1 is not a version of the form X.Y.Z'),
    ('7.8.9', 'CHANGELOG.md has nothing under "Unreleased"'),
])
def test_release_that_cannot_be_writes_nothing(tree, version, said):
    assert release(tree, '7.8.9').returncode == 0
    before = [(tree / name).read_text() for name in FILES]
    done = release(tree, version)
    assert (done.returncode, done.stderr) == (1, f'release: {said}\n')
    assert [(tree / name).read_text() for name in FILES] == before
