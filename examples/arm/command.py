# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``scripts/arm`` without ROS: all runs, in the selected ways, and the pictures."""

import argparse
from collections.abc import Sequence
from contextlib import nullcontext
from functools import partial
import json
from pathlib import Path
import sys

from tf_tree_py.labs.report import NoPicture
from tf_tree_py.labs.tf_lab import progress

from . import trial
from .mistakes import MISTAKES, WAYS
from .options import NAME, parser
from .report import as_dict, row, summary, Trial

ALL = 'all'


def run(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    arguments = _parser().parse_args(argv)
    mistake = arguments.mistake
    names = {None: ['right'], ALL: ['right', *MISTAKES]}.get(mistake, [mistake])
    try:
        if arguments.out is not None:
            arguments.out.mkdir(parents=True, exist_ok=True)
        outcomes = {name: _trials(name, arguments) for name in names}
        if arguments.json:
            first, *rest = (as_dict(name, trials) for name, trials in outcomes.items())
            print(json.dumps({'seed': arguments.seed, **first, 'mistakes': rest}, indent=2))
        if arguments.out is not None:
            _draw(outcomes[names[0]], arguments)
    except BrokenPipeError:
        raise
    except (NoPicture, OSError) as error:
        print(f'{NAME}: {error}', file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    options = parser()
    options.add_argument('--mistake', choices=[*MISTAKES, ALL],
                         help='make this mistake; with "all", run correctly and then with each '
                              'mistake')
    options.add_argument('--out', type=Path, metavar='DIR',
                         help='also draw the pictures into a folder')
    return options


def _trials(name: str, arguments: argparse.Namespace) -> list[Trial]:
    """Do all runs in one way; print the result of each, unless the output is JSON."""
    tell = _be_silent if arguments.json else partial(print, flush=True)
    tell(f'{name}: {WAYS[name].summary}')
    trials = []
    with progress(f'{NAME}: {name}') if arguments.json else nullcontext():
        for number in range(arguments.runs):
            trials.append(trial.run(number, arguments.seed, WAYS[name]))
            tell(row(trials[-1]))
    tell(f'{summary(trials)}\n')
    return trials


def _be_silent(line: str) -> None:
    pass


def _draw(trials: Sequence[Trial], arguments: argparse.Namespace) -> None:
    # A late import, because it is slow.
    from .film import film
    from .pictures import draw_all
    with progress(f'{NAME}: the pictures'):
        paths = [*draw_all(trials, arguments.out),
                 film(arguments.seed, arguments.out / 'pick_and_place.gif')]
    print('The pictures: ' + ', '.join(map(str, paths)),
          file=sys.stderr if arguments.json else sys.stdout)
