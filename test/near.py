# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Select the test files that concern a change, the nearest first; used by ``scripts/test --near``.

python test/near.py [REVISION]

Without a revision, the change is the work tree against HEAD, or, if the work tree is clean, the
last commit. A test that starts no process is selected if a chain of imports leads from it to a
changed file. A test that starts processes is selected if it imports a changed file of the layer
that it tests. Every test is selected if it, or a helper that it uses, names a changed file: so a
test declares a file that it reads or runs without importing it.
"""

import ast
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
import re
import subprocess
import sys

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE, TESTS = REPOSITORY / 'tf_tree_py', REPOSITORY / 'test'

# A file that imports one of these starts processes, or is one of several in a DDS network.
PROCESSES = {'subprocess', 'multiprocessing', 'playwright'}
DDS = {'rclpy'}


@cache
def names_of(path: Path) -> Mapping[str, str]:
    """Return the imports of a file: each bound name, and the dotted name of its origin."""
    found: dict[str, str] = {}
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            found |= {alias.asname or alias.name: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            folder = path.parents[node.level - 1] if node.level else None
            above = '.'.join(folder.relative_to(REPOSITORY).parts) if folder else ''
            module = '.'.join(filter(None, (above, node.module)))
            found |= {alias.asname or alias.name: f'{module}.{alias.name}'
                      for alias in node.names}
    return found


@cache
def helper_named(name: str, tests: Path) -> Path | None:
    """Return the test helper of a name: tests import them without their folder."""
    return next(tests.glob(f'**/{name}.py'), None)


def file_of(dotted: str) -> Path | None:
    """Return our file that defines a dotted name, also through packages that re-export it."""
    path = REPOSITORY.joinpath(*dotted.split('.'))
    if path.with_suffix('.py').is_file():
        return path.with_suffix('.py')
    if (path / '__init__.py').is_file():
        return path / '__init__.py'
    above, _, name = dotted.rpartition('.')
    if not above:
        return helper_named(dotted, TESTS)
    home = file_of(above)
    passed_on = names_of(home).get(name) if home and home.name == '__init__.py' else None
    return file_of(passed_on) if passed_on else home


@cache
def imports_of(path: Path) -> frozenset[Path]:
    """Return our files that a file imports."""
    return frozenset(filter(None, map(file_of, names_of(path).values()))) - {path}


def helpers_of(test: Path) -> Iterable[Path]:
    """Return the files in ``test/`` that a test uses, itself first: a chain of imports."""
    return distances(test, TESTS)


@cache
def distances(path: Path, inside: Path) -> Mapping[Path, int]:
    """
    Return every file reachable by imports from one, and the length of the shortest chain.

    :param inside: a folder; files outside it are not followed.
    """
    reached, waiting = {path: 0}, deque([path])
    while waiting:
        here = waiting.popleft()
        for there in imports_of(here) - reached.keys():
            if inside in there.parents:
                reached[there] = reached[here] + 1
                waiting.append(there)
    return reached


def needs(path: Path, modules: set[str]) -> bool:
    """Return whether a test, or a test helper that it imports, imports from one of these."""
    return any(name == module or name.startswith(f'{module}.') for module in modules
               for file in helpers_of(path) for name in names_of(file).values())


def is_named(changed: Path, test: Path) -> bool:
    """Return whether a test is named after a changed file; or it or a helper names the file."""
    if test.stem == f'test_{changed.stem}':
        return True
    # A name of one word, such as parameters, is also a word in many tests.
    command = changed.parent.name in ('tools', 'nodes') and '_' in changed.stem.strip('_')
    name = changed.stem if command else changed.name
    return any(re.search(rf'\b{re.escape(name)}\b', file.read_text(encoding='utf-8'))
               for file in helpers_of(test))


def is_of_layer(changed: Path, test: Path) -> bool:
    """Return whether a changed file is in the layer of a test, or in the test's folder."""
    return test.relative_to(TESTS).parts[0] in changed.relative_to(REPOSITORY).parts


def changed_files(revision: str | None) -> set[Path]:
    """Return the files that differ from a revision, by default as the module's text describes."""
    def listed(*command: str) -> set[Path]:
        done = subprocess.run(['git', *command], cwd=REPOSITORY, capture_output=True, text=True,
                              check=True)
        return {REPOSITORY / name for name in done.stdout.splitlines()}

    new = listed('ls-files', '--others', '--exclude-standard')
    return (listed('diff', '--name-only', revision or 'HEAD') | new
            or listed('diff', '--name-only', 'HEAD~1'))


def near(changed: set[Path]) -> Iterator[tuple[bool, int, Path]]:
    """Yield each selected test file: whether it starts processes, and its distance."""
    for test in TESTS.glob('**/test_*.py'):
        reached = distances(test, REPOSITORY)
        slow = needs(test, PROCESSES | DDS)
        chains = [0 for file in changed if is_named(file, test)]
        chains += [reached[file] for file in changed & reached.keys()
                   if not slow or reached[file] <= 1 and is_of_layer(file, test)]
        if chains:
            yield slow, min(chains), test


if __name__ == '__main__':
    for *_, chosen in sorted(near(changed_files(*sys.argv[1:2] or [None]))):
        print(chosen.relative_to(REPOSITORY))
