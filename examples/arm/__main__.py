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
from .options import NAME, parser
from .report import as_dict, row, summary, Trial
from .trial import run

ALL = 'all'


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
    options = parser()
    options.add_argument('--mistake', choices=[*MISTAKES, ALL],
                         help='do it wrongly; with "all", rightly and then in each wrong way')
    options.add_argument('--out', type=Path, metavar='DIR',
                         help='draw the pictures into a folder, too')
    return options


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
