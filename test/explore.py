# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Try new random examples and new orders of the tests, round after round.

python test/explore.py [--seed N] [--minutes M] [PATH ...] [pytest arguments]

A round tries new examples with every test that uses hypothesis; then it runs some of all test
files in one process, in a random order, to find what one test leaves behind and another one meets.

Every round has its own seed: the first is that of ``--seed``, or drawn and printed, and each
later one is higher by one. New rounds begin until the minutes have passed. A test that fails is
printed once, with the shortest example that hypothesis found and the command that repeats it; it
is left out of later rounds. ``scripts/test --explore`` runs this in the environment of ROS.
"""

import argparse
from collections.abc import Callable, Sequence
import importlib.util
import json
import os
from pathlib import Path
import random
import secrets
import shlex
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

from near import needs, REPOSITORY, TESTS

# pytest's status if tests have failed, and if no test was selected.
_FAILED, _NONE = 1, 5
# The environment of the simulated arm is another one.
_ELSEWHERE = TESTS / 'arm'
# The files of a round that one process runs: several minutes.
_IN_ONE_PROCESS = 40
# A test that hangs, because of one before it, must end the process.
_LIMITS = ['-o', 'faulthandler_timeout=600', '-o', 'faulthandler_exit_on_timeout=true']

# One process, which runs the files in the order in which they are named.
_ORDERLY = ['--hypothesis-profile', 'brief', '-m', 'not linter']


def all_test_files() -> list[str]:
    """Return all test files, but those of another environment."""
    return [str(path.relative_to(REPOSITORY)) for path in sorted(TESTS.glob('**/test_*.py'))
            if _ELSEWHERE not in path.parents]


def explored_files() -> list[str]:
    """Return the test files that use hypothesis."""
    return [file for file in all_test_files() if needs(REPOSITORY / file, {'hypothesis'})]


def files_of(arguments: Sequence[str]) -> list[str]:
    """Return the test files among the arguments and in folders among them; not single tests."""
    paths = [Path(argument) for argument in arguments if not argument.startswith('-')]
    return [str(file) for path in paths
            for file in ([path] if path.is_file() else sorted(path.glob('**/test_*.py')))]


def names_a_path(arguments: Sequence[str]) -> bool:
    """Return whether one of the arguments is a file, a folder or a test."""
    return any(Path(argument.partition('::')[0]).exists() for argument in arguments)


def run_examples(seed: int, arguments: Sequence[str], known: Sequence[str], cache: str) -> int:
    """Try the examples of a seed; print what fails, and return pytest's status."""
    workers = (['-n', 'auto', '--dist', 'worksteal', '--max-worker-restart', '0']
               if importlib.util.find_spec('xdist') else [])
    return _run(f'seed {seed}', [
        *workers, '-m', 'hypothesis', '--hypothesis-profile', 'explore',
        f'--hypothesis-seed={seed}', *(f'--deselect={each}' for each in known), *arguments], cache)


def order_of(seed: int, files: Sequence[str]) -> list[str]:
    """Return some of the files, in the order of a seed."""
    return random.Random(seed).sample(files, min(len(files), _IN_ONE_PROCESS))


def run_in_order(seed: int, files: Sequence[str], known: Sequence[str], cache: str) -> int:
    """Run files in their order in one process; print what fails, and return pytest's status."""
    return _run(f'seed {seed}, {len(files)} files in one process',
                [*_ORDERLY, *(f'--deselect={each}' for each in known), *files], cache)


def _run(title: str, arguments: Sequence[str], cache: str) -> int:
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', '-o', f'cache_dir={cache}', '--quiet', '--no-header',
         '--tb=short', '-r', 'fE', *_LIMITS, *arguments],
        cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    summary = done.stdout.rstrip().rpartition('\n')[2].strip('= ')
    print(f'{title}: {summary or "no output"} ({time.monotonic() - begin:.0f} s)', flush=True)
    if done.returncode:
        print(done.stdout, flush=True)
    return done.returncode


def failures_in(cache: str) -> list[str]:
    """Return the tests that failed in the last round."""
    file = Path(cache, 'v', 'cache', 'lastfailed')
    return list(json.loads(file.read_text(encoding='utf-8'))) if file.exists() else []


def repeats_example(seed: int, test: str) -> str:
    """Return the command that tries the examples of a test once more."""
    return f'scripts/test --explore --seed {seed} --minutes 0 {shlex.quote(test)}'


def repeats_order(files: Sequence[str], test: str) -> str:
    """Return the command that runs the files once more, up to that of the test."""
    last = next((number for number, file in enumerate(files) if test.startswith(file)), len(files))
    return shlex.join(['scripts/test', *_ORDERLY, *files[:last + 1]])


class Exploration:
    """Rounds, and what failed in them: by test, the command that repeats it."""

    def __init__(self, arguments: Sequence[str], files: Sequence[str]) -> None:
        self._arguments, self._files = arguments, files
        self.found: dict[str, str] = {}

    def run_round(self, seed: int) -> int:
        """Run a round; return a status of pytest that ends the exploration, or 0."""
        with TemporaryDirectory() as cache:
            status = run_examples(seed, self._arguments, list(self.found), cache)
            ends = self._add(status, cache, lambda test: repeats_example(seed, test))
        if ends or len(self._files) < 2:
            return ends
        order = order_of(seed, self._files)
        with TemporaryDirectory() as cache:
            status = run_in_order(seed, order, list(self.found), cache)
            return self._add(status, cache, lambda test: repeats_order(order, test))

    def _add(self, status: int, cache: str, repeats: Callable[[str], str]) -> int:
        failed = failures_in(cache)
        for test in failed:
            self.found[test] = repeats(test)
        return status if status not in (0, _FAILED) or (status and not failed) else 0


def explore(first: int, minutes: float, arguments: Sequence[str], files: Sequence[str]) -> int:
    """Run rounds until the time has passed; return the status of this program."""
    end = time.monotonic() + 60.0 * minutes
    exploration = Exploration(arguments, files)
    seed, rounds = first, 0
    print(f'seed {first}: the first round; the next round has the next seed', flush=True)
    while not rounds or time.monotonic() < end:
        status = exploration.run_round(seed)
        if status == _NONE and exploration.found:
            break  # all of them have failed
        if status:
            return status  # no tests, a wrong argument, or a crash
        seed, rounds = seed + 1, rounds + 1
    print(f'{rounds} rounds, {len(exploration.found)} tests failed')
    for command in exploration.found.values():
        print(f'  {command}')
    return _FAILED if exploration.found else 0


def main() -> int:
    """Parse the arguments; those for pytest are passed to it."""
    parser = argparse.ArgumentParser(
        prog='scripts/test --explore', allow_abbrev=False,
        description='Try new random examples, and new orders of the test files.')
    parser.add_argument('--seed', type=int, help='of the first round (default: drawn)')
    parser.add_argument('--minutes', type=float, default=10.0,
                        help='begin no round later than this (default: %(default)s; 0: one round)')
    options, arguments = parser.parse_known_args()
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    files = files_of(arguments)
    if not names_a_path(arguments):
        files = all_test_files()
        arguments += explored_files()
    # As in scripts/test: the workers keep all processors busy, so numpy's threads would wait.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    return explore(seed, options.minutes, arguments, files)


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
