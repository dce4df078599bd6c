# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Put small faults into the code, one at a time, and report those that no test finds.

python test/mutate.py [--count N] [--seed N] [--list] [PATH[:LINE] ...]

The faults are those of ``mutations.py``. They are put into a copy of the repository, where the
tests run, so the work tree stays as it is. The test files nearest to the changed file run first,
then all others that can reach it; those that do not run the changed line are left out. Which lines
a test file runs is recorded by ``run_lines.py`` when it is first needed, and kept in the workspace
until the test, or a file that it imports, changes. ``scripts/mutate`` runs this in the environment
of ROS.
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
import difflib
from functools import cache
import hashlib
import json
import os
from pathlib import Path
import random
import re
import shutil
import signal
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import NamedTuple

from mutations import Mutant, mutants_of
import near
from near import PACKAGE, REPOSITORY, TESTS

ROOMS = ['core', 'ros/waiting', 'ros/threads', 'health', 'bag/assembly']
_EQUIVALENTS = TESTS / 'equivalent_mutants.txt'
_CACHE = Path(os.environ.get('TF_TREE_PY_WORKSPACE') or REPOSITORY / '.workspace') / 'mutation'

# The test files that run first.
_NEAREST = 5
# Until a test counts as hanging: this many times as long as without a fault, and some seconds,
# because the machine may be busy.
_TIMES, _SPARE_S = 3.0, 10.0
# Tests without a fault may take this long.
_PATIENCE_S = 600.0
_PYTEST = [sys.executable, '-m', 'pytest', '-x', '-q', '--no-header', '--tb=no', '-r', 'fE',
           '-p', 'no:cacheprovider', '--hypothesis-profile', 'mutants']
_NO_TESTS = 5


class Run(NamedTuple):
    """
    What a test file does without a fault.

    :ivar lines: by file, those that it runs; None if it fails.
    """

    seconds: float
    lines: dict[str, set[int]] | None


class Verdict(NamedTuple):
    """:ivar kind: caught, timeout, survived or equivalent."""

    kind: str
    detail: str = ''

    def __str__(self) -> str:
        """Return it as the end of a line."""
        return f'{self.kind}{self.detail}'


@dataclass
class Fault:
    """A mutant of a file, whose source it keeps: the file may be edited meanwhile."""

    file: Path
    source: bytes
    mutant: Mutant
    verdict: Verdict | None = None

    @property
    def name(self) -> str:
        """Return the path of the file from the repository."""
        return str(self.file.relative_to(REPOSITORY))

    @property
    def key(self) -> tuple[str, str, str]:
        """Return how the list of equivalent mutants names it."""
        before, after = self.mutant.texts(self.source)
        return f'{self.name} {self.mutant.place}'.strip(), before, after

    def __str__(self) -> str:
        """Return it as a line."""
        _, before, after = self.key
        return f'{self.name}:{self.mutant.line}  {before}  ->  {after}'

    def diff(self) -> str:
        """Return the change as ``diff`` prints it."""
        before, after = (text.decode().splitlines(keepends=True)
                         for text in (self.source, self.mutant.apply(self.source)))
        return ''.join(difflib.unified_diff(before, after, self.name, self.name))


# --- the nearest tests

@cache
def _words(path: Path) -> Counter[str]:
    return Counter(re.findall(r'\w+', path.read_text(encoding='utf-8')))


def _names_in(file: Path) -> set[str]:
    """Return the public names that a file defines."""
    return set(re.findall(r'(?:class|def) ([^\W_]\w*)', file.read_text(encoding='utf-8')))


def _namesakes(file: Path) -> set[str]:
    """Return what the tests of a file are called: JumpBack is tested in test_jump_back."""
    return {f'test_{re.sub("(?<=[a-z])(?=[A-Z])", "_", name).lower()}'
            for name in {file.stem, *_names_in(file)}}


def tests_of(file: Path) -> list[Path]:
    """
    Return the test files that can reach a file, the nearest first.

    These are the tests of its layer that a chain of imports leads from, and all that import it
    themselves. The nearest have its name, or that of something that it defines; next are those
    that mention what it defines and few others mention.
    """
    reached = {test: near.distances(test, REPOSITORY) for test in TESTS.glob('**/test_*.py')}
    reached = {test: lengths[file] for test, lengths in reached.items() if file in lengths}
    direct = {test for test, length in reached.items() if length == 1}
    homes = ({TESTS / part for part in file.relative_to(PACKAGE).parts if (TESTS / part).is_dir()}
             or {test.parent for test in direct})
    tests = [test for test in reached if test.parent in homes or test in direct]
    common = Counter(name for test in tests for name in _words(test).keys() & _names_in(file))

    namesakes = _namesakes(file)

    def distance(test: Path) -> tuple[bool, float, Path]:
        own = sum(1 / common[name] for name in _words(test).keys() & common.keys())
        return test.stem not in namesakes, -own, test

    return sorted(tests, key=distance)


# --- the copy in which the tests run

class Bench:
    """A copy of the repository, and what its tests run without a fault."""

    def __init__(self, folder: Path) -> None:
        self._copy, self._path = folder / 'copy', folder / 'path'
        self._count = 0
        self._runs: dict[Path, Run] = {}
        self._path.mkdir()
        shutil.copy(TESTS / 'run_lines.py', self._path / 'sitecustomize.py')
        listed = subprocess.run(
            ['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
            cwd=REPOSITORY, capture_output=True, text=True, check=True).stdout
        for name in filter(None, listed.split('\0')):
            if (REPOSITORY / name).is_file():
                (self._copy / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(REPOSITORY / name, self._copy / name)
        inherited = os.environ.get('PYTHONPATH')
        self._variables = {
            **os.environ, 'PYTHONPYCACHEPREFIX': str(folder / 'bytecode'),
            'PYTHONPATH': os.pathsep.join(map(str, filter(None, [self._copy, inherited])))}
        self._variables.pop('PYTHONDONTWRITEBYTECODE', None)
        # As in scripts/test.
        self._variables.setdefault('OPENBLAS_NUM_THREADS', '1')

    def judge(self, fault: Fault) -> Verdict:
        """Run the tests with a fault until one fails."""
        seen = False
        for tests in self._tiers(fault):
            seen = True
            limit_s = _SPARE_S + _TIMES * sum(self.run(test).seconds for test in tests)
            verdict = self._judge(fault, tests, limit_s)
            if verdict.kind != 'survived':
                return verdict
        return Verdict('survived', '' if seen else ', no test runs this line')

    def _tiers(self, fault: Fault) -> Iterator[list[Path]]:
        """Yield the nearest test files that run the lines of a fault, then all others."""
        tests = tests_of(fault.file)
        if nearest := [test for test in tests[:_NEAREST] if self._reaches(test, fault)]:
            yield nearest
        if others := [test for test in tests[_NEAREST:] if self._reaches(test, fault)]:
            yield sorted(others, key=lambda test: self.run(test).seconds)

    def _reaches(self, test: Path, fault: Fault) -> bool:
        lines = self.run(test).lines
        return lines is not None and not lines.get(fault.name, set()).isdisjoint(
            fault.mutant.lines)

    def _judge(self, fault: Fault, tests: Sequence[Path], limit_s: float) -> Verdict:
        file = self._copy / fault.name
        before = file.stat()
        self._count += 1
        try:
            file.write_bytes(fault.mutant.apply(fault.source))
            # Bytecode belongs to the time and the size of its source, and most mutants have the
            # same size; so each has a time of its own.
            os.utime(file, (self._count, self._count))
            status, output = self._pytest(tests, limit_s)
        finally:
            file.write_bytes(fault.source)
            os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
        if status is None:
            return Verdict('timeout', f' after {limit_s:.0f} s')
        if status in (0, _NO_TESTS):
            return Verdict('survived')
        failed = re.search(r'^(?:FAILED|ERROR) (\S+)', output, re.MULTILINE)
        return Verdict('caught', f' by {failed[1] if failed else f"status {status}"}')

    def _pytest(self, tests: Sequence[Path], limit_s: float, **variables: str
                ) -> tuple[int | None, str]:
        """Return pytest's status and output; None if it takes too long."""
        names = [str(test.relative_to(REPOSITORY)) for test in tests]
        with subprocess.Popen(
                [*_PYTEST, *names], cwd=self._copy, env={**self._variables, **variables},
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                text=True, errors='replace', start_new_session=True) as process:
            try:
                output, _ = process.communicate(timeout=limit_s)
                return process.returncode, output
            except subprocess.TimeoutExpired:
                return None, ''
            finally:
                # And what its tests have started.
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)

    # --- without a fault

    def run(self, test: Path) -> Run:
        """Run a test file without a fault, unless that has been done."""
        if test not in self._runs:
            self._runs[test] = self._kept_run(test)
        return self._runs[test]

    def _kept_run(self, test: Path) -> Run:
        kept = _CACHE / f'{test.stem}-{_digest(test)}.json'
        if kept.exists():
            seconds, lines = json.loads(kept.read_text(encoding='utf-8'))
        else:
            seconds, lines = self._measure(test)
            if lines is not None:
                _keep(kept, f'{test.stem}-*.json', json.dumps([seconds, lines]))
        return Run(seconds, None if lines is None
                   else {name: set(numbers) for name, numbers in lines.items()})

    def _measure(self, test: Path) -> tuple[float, dict[str, list[int]] | None]:
        print(f'(recording the lines that {test.relative_to(REPOSITORY)} runs)',
              file=sys.stderr, flush=True)
        output = self._path / 'lines'
        output.unlink(missing_ok=True)
        begin = time.monotonic()
        path = os.pathsep.join([str(self._path), self._variables['PYTHONPATH']])
        status, text = self._pytest(
            [test], _PATIENCE_S, PYTHONPATH=path, RUN_LINES=str(output),
            RUN_LINES_OF=str(self._copy))
        seconds = time.monotonic() - begin
        if status not in (0, _NO_TESTS):
            print(f'{test.relative_to(REPOSITORY)} fails without a fault, and is left out:\n'
                  f'{text[-400:]}', file=sys.stderr, flush=True)
            return seconds, None
        lines: dict[str, set[int]] = {}
        for line in output.read_text(encoding='utf-8').split():
            name, _, number = line.rpartition(':')
            if name.startswith(f'{PACKAGE.name}/'):
                lines.setdefault(name, set()).add(int(number))
        return seconds, {name: sorted(numbers) for name, numbers in lines.items()}


def _keep(file: Path, older: str, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    for old in file.parent.glob(older):
        old.unlink()
    file.write_text(text, encoding='utf-8')


def _digest(test: Path) -> str:
    """Return a word that changes with a test file, and with all files that it uses."""
    files = {*near.distances(test, REPOSITORY), *TESTS.glob('**/conftest.py'),
             TESTS / 'run_lines.py'}
    if near.needs(test, near.PROCESSES):
        files.update(PACKAGE.glob('**/*.py'))
    digest = hashlib.sha256(sys.version.encode())
    for file in sorted(files):
        digest.update(str(file.relative_to(REPOSITORY)).encode() + file.read_bytes())
    return digest.hexdigest()[:16]


# --- the report

def equivalents() -> dict[tuple[str, ...], str]:
    """Return the reasons in the list of equivalent mutants, by what ``Fault.key`` returns."""
    text = '\n'.join(line for line in _EQUIVALENTS.read_text(encoding='utf-8').splitlines()
                     if not line.startswith('#'))
    entries = re.findall(r'^(\S.*)\n +before: (.*)\n +after: ?(.*)\n +why: (.*)$', text,
                         re.MULTILINE)
    if len(entries) != len(re.findall(r'^\S', text, re.MULTILINE)):
        raise SystemExit(f'{_EQUIVALENTS}: an entry has not the form that its beginning shows')
    for *key, _ in entries:
        file = REPOSITORY / key[0].split()[0]
        if not file.exists() or tuple(key) not in {fault.key for fault in _faults_of(file)}:
            raise SystemExit(f'{_EQUIVALENTS}: no fault fits {" ".join(key)}: remove that entry')
    return {tuple(key): why for *key, why in entries}


def _faults_of(file: Path) -> list[Fault]:
    source = file.read_bytes()
    return [Fault(file, source, mutant) for mutant in mutants_of(source)]


def faults_in(argument: str) -> list[Fault]:
    """Return the faults for a file, for one of its lines, or for a folder."""
    name, _, line = argument.partition(':')
    path = Path(name).resolve()
    if not path.is_relative_to(PACKAGE) or not path.exists():
        raise SystemExit(f'{name} is no file or folder below {PACKAGE}')
    files = [path] if path.is_file() else sorted(path.glob('**/*.py'))
    return [fault for file in files for fault in _faults_of(file)
            if not line or fault.mutant.line == int(line)]


def room_of(fault: Fault) -> str:
    """Return the room in the table: one of ``ROOMS``, or else the folder of the file."""
    inside = fault.file.relative_to(PACKAGE)
    return next((room for room in ROOMS if inside.is_relative_to(room)), str(inside.parent))


@dataclass
class Report:
    """Judges faults, and prints each at once."""

    known: dict[tuple[str, ...], str]
    faults: list[Fault] = field(default_factory=list)

    def run(self, faults: Sequence[Fault]) -> None:
        """Judge the faults in a copy of the repository."""
        with TemporaryDirectory(prefix='mutants-') as folder:
            bench = Bench(Path(folder))
            for fault in faults:
                begin = time.monotonic()
                why = self.known.get(fault.key)
                fault.verdict = Verdict('equivalent', f', {why}') if why else bench.judge(fault)
                self.faults.append(fault)
                print(f'{fault}  {fault.verdict} ({time.monotonic() - begin:.1f} s)', flush=True)

    @property
    def survivors(self) -> list[Fault]:
        """Return those that no test has found."""
        return [fault for fault in self.faults if fault.verdict.kind == 'survived']

    def finish(self) -> None:
        """Print the table, and the survivors."""
        kinds = 'caught', 'timeout', 'equivalent', 'survived'
        counts = Counter((room_of(fault), fault.verdict.kind) for fault in self.faults)
        print(f'\n{"room":20}' + ''.join(f'{kind:>12}' for kind in kinds))
        for room in dict.fromkeys(map(room_of, self.faults)):
            print(f'{room:20}' + ''.join(f'{counts[room, kind]:12}' for kind in kinds))
        for fault in self.survivors:
            print(f'\n{fault.diff()}', end='')


def main() -> int:
    """Return 1 if a fault survived."""
    parser = argparse.ArgumentParser(
        prog='scripts/mutate', description='Put small faults into the code, one at a time, and '
        'report those that no test finds. The work tree stays as it is.',
        epilog=f'Faults that change nothing stand in {_EQUIVALENTS.relative_to(REPOSITORY)}.')
    parser.add_argument('paths', nargs='*', metavar='PATH[:LINE]',
                        help=f'where (default: {", ".join(ROOMS)} of {PACKAGE.name})')
    parser.add_argument('--count', type=int, help='so many of the faults, drawn at random')
    parser.add_argument('--seed', type=int, default=1, help='which ones (default: %(default)s)')
    parser.add_argument('--list', action='store_true', help='print them, and run no test')
    options = parser.parse_args()
    paths = options.paths or [str(path) for room in ROOMS if (path := PACKAGE / room).exists()]
    faults = [fault for path in paths for fault in faults_in(path)]
    if options.count is not None and options.count < len(faults):
        faults = random.Random(options.seed).sample(faults, options.count)
    if options.list:
        print(*faults, sep='\n')
        return 0
    if not hasattr(sys, 'monitoring'):
        raise SystemExit('scripts/mutate needs Python 3.12 or later, which records lines quickly')
    report = Report(equivalents())
    try:
        report.run(faults)
    finally:
        report.finish()
    return 1 if report.survivors else 0


if __name__ == '__main__':
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # also removes the copy
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
