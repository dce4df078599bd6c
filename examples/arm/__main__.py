"""The command ``scripts/arm``: a simulated arm picks a block that its camera sees."""

import argparse
from collections.abc import Sequence
from functools import partial
import json
import os
from pathlib import Path
import signal
import sys

from tf_tree_py.labs.progress import progress

from .mistakes import MISTAKES, WAYS
from .report import as_dict, row, summary
from .trial import run, Trial

NAME = 'arm'
ALL = 'all'

_DESCRIPTION = """\
A simulated arm with a camera on its wrist picks a red block and places it in a tray. What the
camera sees, the transform tree takes to the world: docs/pick_and_place.md goes through it."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    arguments = _parser().parse_args(argv)
    try:
        _run(arguments)
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not interrupt the end
        return 130
    except BrokenPipeError:  # as of `| head`; stdout is flushed once more at the end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=NAME, description=_DESCRIPTION, allow_abbrev=False)
    parser.add_argument('--runs', type=_positive, default=20, metavar='N',
                        help='how many blocks, one after the other; 20 unless given')
    parser.add_argument('--seed', type=_natural, default=0, metavar='N',
                        help='which random blocks; 0 unless given')
    parser.add_argument('--mistake', choices=[*MISTAKES, ALL],
                        help='do it wrongly; with "all", rightly and then in each wrong way')
    parser.add_argument('--json', action='store_true', help='print JSON instead')
    parser.add_argument('--out', type=Path, metavar='DIR',
                        help='draw the pictures into a folder, too')
    return parser


def _natural(text: str) -> int:
    if (number := int(text)) < 0:
        raise ValueError
    return number


def _positive(text: str) -> int:
    if (number := int(text)) < 1:
        raise ValueError
    return number


def _run(arguments: argparse.Namespace) -> None:
    mistake = arguments.mistake
    names = {None: ['right'], ALL: ['right', *MISTAKES]}.get(mistake, [mistake])
    outcomes = {name: _trials(name, arguments) for name in names}
    if arguments.json:
        first, *rest = (as_dict(name, trials) for name, trials in outcomes.items())
        print(json.dumps({'seed': arguments.seed, **first, 'mistakes': rest}, indent=2))
    if arguments.out is not None:
        # Imported here, because it takes a while.
        from .film import film
        from .pictures import draw_all
        with progress(f'{NAME}: the pictures'):
            paths = [*draw_all(outcomes[names[0]], arguments.out),
                     film(arguments.seed, arguments.out / 'pick_and_place.gif')]
        print('The pictures: ' + ', '.join(map(str, paths)),
              file=sys.stderr if arguments.json else sys.stdout)


def _trials(name: str, arguments: argparse.Namespace) -> list[Trial]:
    """Do all runs in one way, and tell each when it is over."""
    way = WAYS[name]
    tell = (lambda line: None) if arguments.json else partial(print, flush=True)
    tell(f'{name}: {way.summary}')
    trials = []
    for number in range(arguments.runs):
        trials.append(run(number, arguments.seed, way))
        tell(row(trials[-1]))
    tell(f'{summary(trials)}\n')
    return trials


if __name__ == '__main__':
    sys.exit(main())
