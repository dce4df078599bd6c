# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Add the two SPDX lines, copyright and licence, to every Python file that lacks them.

python scripts/packaging/headers.py [--check]

LICENSE contains the text of the licence.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

REPOSITORY = Path(__file__).resolve().parents[2]

HEADER = """\
# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--check', action='store_true', help='only list the files that lack them')
    check = parser.parse_args().check
    without = [path for path in files() if HEADER not in path.read_text(encoding='utf-8')]
    for path in without:
        if check:
            print(f'{path.relative_to(REPOSITORY)}: no SPDX lines')
        else:
            add(path)
    if check and without:
        sys.exit(f'to add them: python {Path(__file__).relative_to(REPOSITORY)}')


def files() -> Iterator[Path]:
    """Yield every Python file that is not empty, except setup.py."""
    listed = subprocess.run(
        ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard', '*.py'],
        cwd=REPOSITORY, stdout=subprocess.PIPE, text=True, check=True)
    for name in sorted(filter(None, listed.stdout.split('\0'))):
        path = REPOSITORY / name
        if name != 'setup.py' and path.is_file() and path.stat().st_size:
            yield path


def add(path: Path) -> None:
    """Insert the two lines at the top of a file, after a shebang line if there is one."""
    text = path.read_text(encoding='utf-8')
    program, separator, rest = text.partition('\n') if text.startswith('#!') else ('', '', text)
    path.write_text(f'{program}{separator}{HEADER}\n{rest}', encoding='utf-8')


if __name__ == '__main__':
    main()
