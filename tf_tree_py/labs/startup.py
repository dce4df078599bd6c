# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A listener starts before the static publisher: lookups with a timeout wait, others fail."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from functools import partial
import threading
import time
from typing import NamedTuple

import numpy as np
from tf_tree_py.buffer_core import BufferCore
from tf_tree_py.core import LATEST, Pose, TransformException

from .report import Column, Figure, GREY, note, Report, STYLES, Table

SUMMARY = 'lookups at startup, with and without a timeout: who fails, and how long'

STARTS = 50
TIMEOUTS_S = (0.0, 0.1, 0.5, 1.0)
"""The textbook uses 0.1 s; 0 is a lookup without a timeout."""
_FRAME_S = 1.0 / 30.0
"""A program whose lookup fails retries with the next image."""

PARENT, CHILD, POSE = 'base_link', 'camera', Pose(0.2, 0.0, 0.8)

# When the transform arrived over DDS, milliseconds, in fifty recorded starts.
_RECORDED = (
    (119, 1), (124, 7), (126, 6), (129, 2), (131, 1), (195, 5), (196, 6), (288, 2), (290, 5),
    (292, 3), (294, 2), (298, 1), (462, 1), (528, 4), (553, 2), (624, 1), (628, 1))

_AskWithin = Callable[[float], object]


class Start(NamedTuple):
    """One program in one start: its failed lookups, and the seconds until one succeeded."""

    failed: int
    success_s: float


def measure(ask: _AskWithin, begin: Callable[[], object]) -> dict[float, Start]:
    """
    Look up with each timeout, concurrently, until all have succeeded.

    :param ask: looks up with a timeout in seconds; it raises an exception if that fails.
    :param begin: called when all are about to look up.
    """
    began = 0.0

    def start_all() -> None:
        nonlocal began
        began = time.monotonic()
        begin()

    together = threading.Barrier(len(TIMEOUTS_S), start_all)
    given_up = threading.Event()

    def program(timeout_s: float) -> Start:
        together.wait()
        return _until_success(ask, timeout_s, began, given_up)

    with ThreadPoolExecutor(len(TIMEOUTS_S)) as programs:
        try:
            return dict(zip(TIMEOUTS_S, programs.map(program, TIMEOUTS_S), strict=True))
        except BaseException:
            # Such as Ctrl-C: the transform may never arrive now, so all must stop waiting.
            given_up.set()
            together.abort()
            raise


def _until_success(ask: _AskWithin, timeout_s: float, begin: float,
                   given_up: threading.Event) -> Start:
    failed = 0
    while True:
        if given_up.is_set():
            raise CancelledError
        try:
            ask(timeout_s)
        except TransformException:
            failed += 1
            # The program tries again with its next image.
            passed = time.monotonic() - begin
            time.sleep(_FRAME_S - passed % _FRAME_S)
        else:
            return Start(failed, time.monotonic() - begin)


def recorded() -> list[float]:
    """Return the times of arrival of the transform, seconds, one for each start."""
    return [arrival / 1e3 for arrival, times in _RECORDED for _ in range(times)]


def start(arrival_s: float) -> dict[float, Start]:
    """Look up in an empty buffer that gets its only transform after a delay."""
    buffer = BufferCore()
    arrival = threading.Timer(arrival_s, lambda: buffer.insert(
        PARENT, CHILD, LATEST, POSE, static=True))
    outcome = measure(lambda timeout: buffer.lookup_within(timeout, PARENT, CHILD), arrival.start)
    arrival.join()
    return outcome


def run() -> Report:
    """Start 50 times, ten at once."""
    arrivals = recorded()
    with ThreadPoolExecutor(10) as pool:
        starts = list(pool.map(start, arrivals))
    return report(starts, 'The times of arrival of the transform were recorded once over DDS; '
                          '--ros measures them again.')


def report(starts: Sequence[Mapping[float, Start]], where_from: str) -> Report:
    """
    Return the report of the starts.

    :param where_from: a sentence about the source of the times.
    """
    programs = {timeout: [one[timeout] for one in starts] for timeout in TIMEOUTS_S}
    failed = {timeout: sum(one.failed > 0 for one in program)
              for timeout, program in programs.items()}
    # The lookup with the longest timeout returns as soon as the transform has arrived.
    came = [one.success_s for one in programs[TIMEOUTS_S[-1]]]
    counted = ', '.join(f'{timeout:g} s: {count}' for timeout, count in failed.items() if timeout)
    return Report(
        tables=[_table(programs)],
        law=f'without a timeout the first lookup fails on {failed[0.0]} of {len(starts)} starts; '
            f'with one it fails only if the transform takes longer to arrive ({counted} of '
            f'{len(starts)}), and otherwise answers as soon as it has arrived: after '
            f'{np.median(came) * 1e3:.0f} ms in the median, {max(came) * 1e3:.0f} ms at most.',
        remarks=[where_from,
                 '0.1 s is not a guarantee: a timeout at startup must cover discovery, whose '
                 'duration varies. Wait once, with a long timeout, outside the control loop.'],
        numbers={'starts': len(starts), 'came_median_s': float(np.median(came)),
                 'came_worst_s': max(came),
                 'first_failed': {str(timeout): count for timeout, count in failed.items()},
                 'failed_lookups': {str(timeout): sum(one.failed for one in program)
                                    for timeout, program in programs.items()}},
        draw=partial(_draw, programs))


def _table(programs: Mapping[float, Sequence[Start]]) -> Table:
    rows = []
    for timeout, program in programs.items():
        times = [one.success_s for one in program]
        rows.append((timeout, len(program), sum(one.failed > 0 for one in program),
                     sum(one.failed for one in program), float(np.median(times)), max(times)))
    return Table(
        'Lookups of a static transform from the start on, retried with the next image',
        (Column('timeout_s', 'timeout [s]', 'g'), Column('starts', 'starts'),
         Column('first_failed', 'first lookup fails'), Column('failed', 'lookups that fail'),
         Column('median_s', 'first answer: median [ms]', '.1f'),
         Column('worst_s', 'worst [ms]', '.1f')), rows)


def _draw(programs: Mapping[float, Sequence[Start]], figure: Figure) -> None:
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    times = np.sort([one.success_s for one in programs[TIMEOUTS_S[-1]]])
    left.plot(np.concatenate([[0.0], times]), np.arange(len(times) + 1) / len(times) * 100.0,
              drawstyle='steps-post', **{**STYLES[0], 'marker': ''})
    for timeout in TIMEOUTS_S[1:]:
        left.axvline(timeout, color=GREY, linewidth=1.0, linestyle='--',
                     label='timeouts, as on the right' if timeout == TIMEOUTS_S[-1] else None)
        note(left, f'{timeout:g} s', (timeout, 105.0), (3, 0), color=GREY)
    left.set(xlabel='time from the start to the transform [s]', ylim=(0.0, 112.0),
             ylabel=f'share of {len(times)} starts [%]', title='How many have the transform',
             xlim=(0.0, 1.15))
    left.legend(loc='lower right')
    shares = [sum(one.failed > 0 for one in program) / len(program) * 100.0
              for program in programs.values()]
    bars = right.bar(range(len(shares)), shares, facecolor='white', edgecolor='black',
                     hatch='////')
    right.bar_label(bars, fmt='%.0f %%', padding=3)
    right.set_xticks(range(len(shares)), [f'{timeout:g}' if timeout else 'none'
                                          for timeout in programs])
    right.set(xlabel='timeout of the lookup [s]', ylabel='share of starts [%]',
              ylim=(0.0, 112.0), title='Where the first lookup fails')
    right.grid(axis='x', visible=False)
