# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A node's control loop that looks up while /tf arrives; one process at a time."""

from collections.abc import Callable, Iterator
from functools import partial
import math
import time

from .listening import start
from .. import motion
from ..effort import Effort
from ..peers.finding import Contestants
from ..rows import OURS, Row, TF2_ROS
from ..worker import Worker

# Transforms in a message, messages a second, and whether the node listens: a loop without a
# listener shows what the machine and the middleware's other processes cost.
STREAMS = [(38, 100, True), (38, 500, True), (38, 500, False)]
_EDGES, _LOOP_HZ, _BEHIND_S = 10, 100.0, 0.03
# The duration of a loop, in streams; the publisher alone sends before and after it.
_STREAMS_A_LOOP, _MARGIN_S = 2.0, 1.0

# The measurements of the process: displayed name, unit and factor.
_SHOWN = {
    'p50_s': ('a lookup, p50', 'us', 1e6), 'p99_s': ('a lookup, p99', 'us', 1e6),
    'p999_s': ('a lookup, p99.9', 'us', 1e6),
    'late_p99_s': ('the loop wakes late, p99', 'ms', 1e3),
    'unanswered': ('lookups not answered', '%', 1e2), 'cores': ('CPU', '% of a core', 1e2)}
_OF_TF2_ROS, _WAKES_LATE_MS = 0.9, 0.5
_UNHEARD = ', no listener'


def control(contestants: Contestants, effort: Effort) -> Iterator[Row]:
    """Measure a loop of 100 Hz that looks up the transform of 30 ms ago over ten edges."""
    ways: dict[str, Callable[[], Worker]] = {OURS: partial(start, 'control_loop', OURS)}
    if contestants.tf2_ros:
        ways[TF2_ROS] = partial(start, 'control_loop', TF2_ROS)
    for transforms, rate_hz, listens in STREAMS:
        found: dict[str, list[dict[str, float]]] = {way: [] for way in ways}
        for number in range(effort.streams):
            for way in reversed(ways) if number % 2 else ways:
                found[way].append(_run(ways[way], transforms, rate_hz, listens,
                                       _STREAMS_A_LOOP * effort.stream_s))
        yield from _rows(f'{transforms} x {rate_hz} Hz{"" if listens else _UNHEARD}', found)


def _run(start_loop: Callable[[], Worker], transforms: int, rate_hz: int, listens: bool,
         seconds: float) -> dict[str, float]:
    """Run the loop of one node while a publisher sends."""
    edges = motion.chain(transforms).edges
    ends = {'target': edges[0].parent, 'source': edges[_EDGES - 1].child}
    with start('publisher') as publisher, start_loop() as node:
        while not node.call('receives', **ends):
            publisher.call('send_now', seconds=0.2, transforms=transforms, rate_hz=rate_hz)
        publisher.begin('send_now', seconds=seconds + 2.0 * _MARGIN_S, transforms=transforms,
                        rate_hz=rate_hz)
        time.sleep(_MARGIN_S)
        measured = node.call('run', **ends, rate_hz=_LOOP_HZ, behind_s=_BEHIND_S, seconds=seconds,
                             listens=listens)
        publisher.end()
    return dict(measured)


def _rows(stream: str, found: dict[str, list[dict[str, float]]]) -> Iterator[Row]:
    for key, (name, unit, factor) in _SHOWN.items():
        values = {way: [one[key] * factor for one in rounds] for way, rounds in found.items()}
        # A round in which no lookup succeeded has no times.
        answered = {way: kept for way, rounds in values.items()
                    if (kept := [value for value in rounds if not math.isnan(value)])}
        row = Row('control', f'{stream}: {name}', unit, answered)
        listens = not stream.endswith(_UNHEARD)
        if key == 'late_p99_s' and listens:
            row.judge(OURS, _WAKES_LATE_MS)
        elif key != 'unanswered' and answered == values:
            row.compare(OURS, TF2_ROS, _OF_TF2_ROS if key == 'p50_s' and listens else None)
        yield row
