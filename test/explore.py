# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Try new random examples, round after round, with every test that uses hypothesis.

python test/explore.py [--seed N] [--minutes M] [PATH ...] [pytest arguments]

Every round has its own seed: the first is that of ``--seed``, or drawn and printed, and each
later one is higher by one. New rounds begin until the minutes have passed. A test that fails is
printed once, with the shortest example that hypothesis found and the command that repeats it; it
is left out of later rounds. ``scripts/test --explore`` runs this in the environment of ROS.
"""

import argparse
from collections.abc import Iterator, Sequence
import importlib.util
import json
import os
from pathlib import Path
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


def explored_files() -> list[str]:
    """Return the test files that use hypothesis."""
    return [str(path.relative_to(REPOSITORY)) for path in sorted(TESTS.glob('**/test_*.py'))
            if _ELSEWHERE not in path.parents and needs(path, {'hypothesis'})]


def names_a_path(arguments: Sequence[str]) -> bool:
    """Return whether one of the arguments is a file, a folder or a test."""
    return any(Path(argument.partition('::')[0]).exists() for argument in arguments)


def run_round(seed: int, arguments: Sequence[str], known: Sequence[str], cache: str) -> int:
    """Run one round; print what fails, and return pytest's status."""
    workers = (['-n', 'auto', '--dist', 'worksteal', '--max-worker-restart', '0']
               if importlib.util.find_spec('xdist') else [])
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, '-m', 'pytest', *workers, '-m', 'hypothesis',
         '--hypothesis-profile', 'explore', f'--hypothesis-seed={seed}',
         '-o', f'cache_dir={cache}', '--quiet', '--no-header', '--tb=short', '-r', 'fE',
         *(f'--deselect={each}' for each in known), *arguments],
        cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    summary = done.stdout.rstrip().rpartition('\n')[2].strip('= ')
    print(f'seed {seed}: {summary or "no output"} ({time.monotonic() - begin:.0f} s)', flush=True)
    if done.returncode:
        print(done.stdout, flush=True)
    return done.returncode


def failures_in(cache: str) -> list[str]:
    """Return the tests that failed in the last round."""
    file = Path(cache, 'v', 'cache', 'lastfailed')
    return list(json.loads(file.read_text(encoding='utf-8'))) if file.exists() else []


def commands(found: dict[str, int]) -> Iterator[str]:
    """Yield the command that repeats each failure, by test and seed."""
    for test, seed in found.items():
        yield f'scripts/test --explore --seed {seed} --minutes 0 {shlex.quote(test)}'


def explore(first: int, minutes: float, arguments: Sequence[str]) -> int:
    """Run rounds until the time has passed; return the status of this program."""
    end = time.monotonic() + 60.0 * minutes
    found: dict[str, int] = {}
    seed, rounds = first, 0
    print(f'seed {first}: the first round; the next round has the next seed', flush=True)
    while not rounds or time.monotonic() < end:
        with TemporaryDirectory() as cache:
            status = run_round(seed, arguments, list(found), cache)
            failed = failures_in(cache)
        if status == _NONE and found:
            break  # all of them have failed
        if status not in (0, _FAILED) or (status == _FAILED and not failed):
            return status  # no tests, a wrong argument, or a crash
        found |= dict.fromkeys(failed, seed)
        seed, rounds = seed + 1, rounds + 1
    print(f'{rounds} rounds, {len(found)} tests failed')
    for command in commands(found):
        print(f'  {command}')
    return _FAILED if found else 0


def main() -> int:
    """Parse the arguments; those for pytest are passed to it."""
    parser = argparse.ArgumentParser(
        prog='scripts/test --explore', allow_abbrev=False,
        description='Try new random examples with every test that uses hypothesis.')
    parser.add_argument('--seed', type=int, help='of the first round (default: drawn)')
    parser.add_argument('--minutes', type=float, default=10.0,
                        help='begin no round later than this (default: %(default)s; 0: one round)')
    options, arguments = parser.parse_known_args()
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    if not names_a_path(arguments):
        arguments += explored_files()
    # As in scripts/test: the workers keep all processors busy, so numpy's threads would wait.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    return explore(seed, options.minutes, arguments)


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
