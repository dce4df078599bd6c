# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Prepare this tree for a release: ``python scripts/packaging/release.py 0.2.0``.

The "Unreleased" section of CHANGELOG.md becomes the section of the version, with today's date.
package.xml and setup.py get the version. CHANGELOG.rst, from which bloom makes the changelogs
of ROS's packages, is written from CHANGELOG.md. Nothing is committed.
"""

import argparse
from collections.abc import Iterator
import datetime
from pathlib import Path
import re
import sys

UNRELEASED = '## Unreleased\n'


class CannotRelease(Exception):
    """A release cannot be made from the tree."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('version', metavar='X.Y.Z', help='the version of the release')
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
        raise CannotRelease(f'{version} is not a version of the form X.Y.Z')
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
    """Return CHANGELOG.md with the unreleased section as the section of a version."""
    before, heading, rest = changes.partition(UNRELEASED)
    if not heading or not rest.lstrip() or rest.lstrip().startswith('## '):
        raise CannotRelease('CHANGELOG.md has nothing under "Unreleased"')
    if f'\n## {version} ' in changes:
        raise CannotRelease(f'CHANGELOG.md already has a version {version}')
    return f'{before}{UNRELEASED}\n## {version} ({date.isoformat()})\n{rest}'


def with_version(file: Path, pattern: str, version: str) -> str:
    """Return a file's text with another version; the pattern must match exactly once."""
    text, count = re.subn(pattern, rf'\g<1>{version}\g<2>', file.read_text(encoding='utf-8'))
    if count != 1:
        raise CannotRelease(f'{file.name} names a version {count} times, not once')
    return text


def as_rst(changes: str) -> str:
    """Return the versions of CHANGELOG.md in the format of REP 132."""
    title = 'Changelog for package tf_tree_py'
    lines = ['^' * len(title), title, '^' * len(title)]
    for section in re.split('(?m)^## ', changes.partition(UNRELEASED)[2])[1:]:
        heading, _, text = section.partition('\n')
        lines += ['', heading, '-' * len(heading), *_list(text)]
    return '\n'.join(lines) + '\n'


def _list(text: str) -> Iterator[str]:
    """Yield a version's changes as a list of lists: "Added", "Changed" and their items."""
    # Join the lines of each change, because code and links may span several lines.
    for line in re.sub(r'\n +', ' ', text).splitlines():
        if line.startswith('### '):
            yield from (f'* {line[4:]}', '')
        elif line:
            yield f'  * {_inline(line.removeprefix("- "))}'


def _inline(text: str) -> str:
    """Return a line with its code in reStructuredText, and links as plain words."""
    text = re.sub(r'\[([^]]+)\]\([^)]+\)', r'\1', text)
    code = text.split('`')
    for index in range(0, len(code), 2):
        code[index] = re.sub(r'([*_|\\])', r'\\\1', code[index])
    return '``'.join(code)


if __name__ == '__main__':
    main()
