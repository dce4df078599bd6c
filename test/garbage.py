# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Garbage that differs every time, as a hostile or broken sender sends it; and its log lines."""

from collections import defaultdict
import math
import random
import re

from serialized import serialize

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_LONG = 64_000
_COUNT = re.compile(r'(\d+) more (?:of this kind|like this)')
# "from '/talking' (NaN or infinity): ...", or "from '/talking': NaN or infinity, in 1.0 s".
_INCIDENT = re.compile(r"from '([^']*)'(?: \(([^)]*)\): |: ([^:]*), in )")
_COUNT_ALONE = re.compile(r'(?:^|[: ])\d+ more like this')


def garbage(number, now):
    """
    Return the bytes of a TFMessage of one edge, or of none, that no buffer takes in silence.

    :param now: seconds.
    """
    turn, way = divmod(number, len(_WAYS))
    made = _WAYS[way](turn, now)
    return made if isinstance(made, bytes) else serialize([made])


def _edge(parent, child, now, *, pose=IDENTITY, nanosec=0):
    return parent, child, now, nanosec, pose


def _cut(turn, now):
    data = serialize([_edge('map', f'cut_{turn}', now)])
    return data[:5 + turn % (len(data) - 5)]


# The same two edges in turns: after the first, each closes a loop.
_LOOP = ('loop_a', 'loop_b'), ('loop_b', 'loop_a')
_WAYS = (
    lambda turn, now: _edge('map', f'nan_{turn}', now, pose=(math.nan, turn, *IDENTITY[2:])),
    lambda turn, now: _edge('map', f'inf_{turn}', now, pose=(-math.inf, turn, *IDENTITY[2:])),
    lambda turn, now: _edge('map', f'zero_{turn}', now, pose=(float(turn), *6 * [0.0])),
    lambda turn, now: _edge('', f'empty_{turn}', now),
    lambda turn, now: _edge('map', 'x' * _LONG + str(turn), now),
    lambda turn, now: _edge(f'self_{turn}', f'self_{turn}', now),
    lambda turn, now: _edge(*_LOOP[turn % 2], now, nanosec=turn),
    lambda turn, now: _edge('map', f'future_{turn}', now + 10_000 + turn),
    lambda turn, now: _edge('map', 'old', now - 1000 * bool(turn) - turn),
    _cut,
    lambda turn, now: b'\0\1\0\0' + random.Random(turn).randbytes(1 + turn % 200),
    lambda turn, now: _edge('a\n[ERROR] forged \x1b[31m' + str(turn), 'b', now,
                            pose=(math.nan, *IDENTITY[1:])),
)


def told(lines):
    """Return how many messages some lines of a limited log stand for: written, or counted."""
    lines = list(lines)
    alone = sum(_COUNT_ALONE.search(line) is not None for line in lines)
    return len(lines) - alone + sum(int(count) for line in lines for count in _COUNT.findall(line))


def flows_of(lines):
    """Return the lines about incidents, with or without a count, by their kind and sender."""
    flows = defaultdict(list)
    for line in lines:
        sender, one, other = _INCIDENT.search(line).groups()
        flows[one or other, sender].append(line)
    return flows


def omitted(log):
    """Return how many messages a limited log has not written since its last lines."""
    return sum(flow.omitted for flows in list(log._flows.values())
               for flow in list(flows.values()))
