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

"""
Make this tree that of a release: ``python scripts/packaging/release.py 0.2.0``.

What CHANGELOG.md has under "Unreleased" becomes the version's, with the date of today;
package.xml and setup.py get the version; and CHANGELOG.rst, which bloom makes the
changelogs of ROS's packages of, is written from CHANGELOG.md. Nothing is committed.
"""

import argparse
from collections.abc import Iterator
import datetime
from pathlib import Path
import re
import sys

UNRELEASED = '## Unreleased\n'


class CannotRelease(Exception):
    """The tree is not one of which a release can be made."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('version', metavar='X.Y.Z', help='that of the release')
    parser.add_argument('--folder', type=Path, default=Path(__file__).resolve().parents[2],
                        help='where the repository is, if it is not the one of this file')
    options = parser.parse_args()
    try:
        release(options.folder, options.version, datetime.date.today())
    except CannotRelease as error:
        sys.exit(f'release: {error}')
    print(f"Look at git diff. Then: git commit -am 'Release {options.version}' && "
          f'git tag {options.version} && git push --tags')


def release(folder: Path, version: str, date: datetime.date) -> None:
    """
    Write the files of a release.

    :raises CannotRelease: nothing was written.
    """
    if not re.fullmatch(r'\d+\.\d+\.\d+', version):
        raise CannotRelease(f'{version} is no version of the form X.Y.Z')
    changes = released((folder / 'CHANGELOG.md').read_text(encoding='utf-8'), version, date)
    texts = {
        'CHANGELOG.md': changes,
        'CHANGELOG.rst': as_rst(changes),
        'package.xml': with_version(
            folder / 'package.xml', r'(<version>)[^<]+(</version>)', version),
        'setup.py': with_version(folder / 'setup.py', r"(version=')[^']+(',)", version),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding='utf-8')


def released(changes: str, version: str, date: datetime.date) -> str:
    """Return CHANGELOG.md with what is unreleased as a version's."""
    before, heading, rest = changes.partition(UNRELEASED)
    if not heading or not rest.lstrip() or rest.lstrip().startswith('## '):
        raise CannotRelease('CHANGELOG.md has nothing under "Unreleased"')
    if f'\n## {version} ' in changes:
        raise CannotRelease(f'CHANGELOG.md has a version {version} already')
    return f'{before}{UNRELEASED}\n## {version} ({date.isoformat()})\n{rest}'


def with_version(file: Path, pattern: str, version: str) -> str:
    """Return a file's text with another version in its one place."""
    text, count = re.subn(pattern, rf'\g<1>{version}\g<2>', file.read_text(encoding='utf-8'))
    if count != 1:
        raise CannotRelease(f'{file.name} names a version {count} times, not once')
    return text


def as_rst(changes: str) -> str:
    """Return the versions of CHANGELOG.md in the form of REP 132."""
    title = 'Changelog for package tf_tree_py'
    lines = ['^' * len(title), title, '^' * len(title)]
    for section in re.split('(?m)^## ', changes.partition(UNRELEASED)[2])[1:]:
        heading, _, text = section.partition('\n')
        lines += ['', heading, '-' * len(heading), *_list(text)]
    return '\n'.join(lines) + '\n'


def _list(text: str) -> Iterator[str]:
    """Yield a version's changes as a list of lists: "Added", "Changed" and what they have."""
    # One line for each change, for code and links go over the ends of lines.
    for line in re.sub(r'\n +', ' ', text).splitlines():
        if line.startswith('### '):
            yield from (f'* {line[4:]}', '')
        elif line:
            yield f'  * {_inline(line.removeprefix("- "))}'


def _inline(text: str) -> str:
    """Return a line with its code and links as reStructuredText has them; links become words."""
    text = re.sub(r'\[([^]]+)\]\([^)]+\)', r'\1', text)
    code = text.split('`')
    for index in range(0, len(code), 2):
        code[index] = re.sub(r'([*_|\\])', r'\\\1', code[index])
    return '``'.join(code)


if __name__ == '__main__':
    main()
