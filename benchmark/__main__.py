# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The benchmark's command line: ``python -m benchmark``, in ``scripts/bench``'s environment.

Prints the table of each group of rows when the group is complete, and at the end every ratio
with its target; writes JSON, Markdown and plots.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from tf_tree_py.labs.tf_lab import progress

from . import machine, options as command_line, report
from .effort import Effort, FULL, QUICK
from .groups import (
    calibrating,
    continuous,
    control,
    fleets,
    growth,
    growth_processes,
    inserting,
    joints,
    listening,
    lookups,
    many,
    memory,
    recordings,
    sharing,
    uncertain,
    waiting,
)
from .peers.finding import Contestants
from .publishing import draw, publish, refuse_absent, renew, say
from .rows import Row

_REPOSITORY = Path(__file__).resolve().parent.parent

GROUPS: dict[str, Callable[[Contestants, Effort], Iterator[Row]]] = {
    'depth': lookups.depths,
    'history': lookups.histories,
    'humanoid': lookups.humanoid,
    'tree': lookups.whole_tree,
    'many': many.many,
    'continuous': continuous.continuous,
    'uncertain': uncertain.uncertain,
    'calibration': calibrating.calibration,
    'listener': listening.listening,
    'control': control.control,
    'joints': joints.joints,
    'doctor': listening.watching,
    'wait': waiting.waiting,
    'shared': sharing.sharing,
    'insert': inserting.inserting,
    'memory': memory.memory,
    'bag': recordings.recordings,
    'fleet': fleets.listening,
    'fleet_lag': fleets.lag,
    'fleet_link': fleets.link,
    'growth_samples': growth.samples,
    'growth_frames': growth.frames,
    'growth_threads': growth.threads,
    'growth_memory': growth_processes.memory,
    'growth_rates': growth_processes.rates,
    'growth_bags': growth_processes.bags,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the requested measurements."""
    options = command_line.parse(arguments)
    if options.redraw:
        renew(_REPOSITORY)
        return
    effort = QUICK if options.quick else FULL
    measured_on = machine.describe(options.quick)
    rows: list[Row] = []
    absent: dict[str, str] = {}
    if options.resume:
        rows, measured_on, absent = _begun(options.out, measured_on)
    # Now, so that --resume never continues the run before this one.
    report.write(options.out, rows, measured_on, absent)
    done = {row.group for row in rows}
    with Contestants() as contestants:
        if options.docs:
            refuse_absent(contestants.absent)
        print(report.machine_lines(measured_on, contestants.absent), flush=True)
        for name in options.only or GROUPS:
            if name in done:
                continue
            say(f'measuring: {name}')
            with progress(f'benchmark: {name}'):
                found = list(GROUPS[name](contestants, effort))
            rows += found
            print(f'\n{report.group_table(found)}', flush=True)
            absent |= contestants.absent
            # An interrupted run keeps what it has measured; see --resume.
            report.write(options.out, rows, measured_on, absent)
    measured_on['load_after'] = machine.load()
    print(f'\n{report.comparison_table(rows)}')
    report.write(options.out, rows, measured_on, absent)
    draw(options.out, rows)
    say(f'written to {options.out}')
    if options.docs:
        publish(_REPOSITORY, rows, measured_on, absent)


def _begun(folder: Path, now: report.Machine
           ) -> tuple[list[Row], report.Machine, dict[str, str]]:
    """
    Return what an interrupted run measured, and on which machine.

    :param now: the present machine.
    :raises SystemExit: there is none, or the rest would not be measured in the same way.
    """
    try:
        rows, measured_on, absent = report.read(folder)
    except (OSError, ValueError) as error:
        raise SystemExit(f'benchmark: there is no run to continue: {error}') from None
    changed = machine.differences(measured_on, now)
    if changed:
        raise SystemExit(f'benchmark: the run in {folder} cannot be continued, because '
                         f'{", ".join(changed)} changed: begin a new one')
    return rows, measured_on, absent


if __name__ == '__main__':
    main()
