"""
Put the notice of copyright and licence on top of every Python file that has none.

python scripts/packaging/headers.py [--check]

It is the notice that ament_copyright looks for, and adds itself where it is installed.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
import subprocess
import sys

REPOSITORY = Path(__file__).resolve().parents[2]

HEADER = """\
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--check', action='store_true', help='only name the files that have none')
    check = parser.parse_args().check
    without = [path for path in files() if HEADER not in path.read_text(encoding='utf-8')]
    for path in without:
        if check:
            print(f'{path.relative_to(REPOSITORY)}: no notice of copyright and licence')
        else:
            add(path)
    if check and without:
        sys.exit(f'to add them: python {Path(__file__).relative_to(REPOSITORY)}')


def files() -> Iterator[Path]:
    """Yield the files that ament_copyright reads: not setup.py, and none that is empty."""
    listed = subprocess.run(
        ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard', '*.py'],
        cwd=REPOSITORY, stdout=subprocess.PIPE, text=True, check=True)
    for name in sorted(filter(None, listed.stdout.split('\0'))):
        path = REPOSITORY / name
        if name != 'setup.py' and path.is_file() and path.stat().st_size:
            yield path


def add(path: Path) -> None:
    """Put the notice in front of a file's first line, but behind one that starts a program."""
    text = path.read_text(encoding='utf-8')
    program, separator, rest = text.partition('\n') if text.startswith('#!') else ('', '', text)
    path.write_text(f'{program}{separator}{HEADER}\n{rest}', encoding='utf-8')


if __name__ == '__main__':
    main()
