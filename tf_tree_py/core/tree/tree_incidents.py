# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The incidents of samples that change the tree, or are refused because they would.

This file has the sentences; ``tree`` has the rules.
"""

from .climb import Loop
from ..edges.protocol import History, moves, MovingHistory
from ..messages.incidents import Incident, is_ambiguous, Kind
from ..stamp import format_span, format_stamp

# The maximum number of reported conflicts; all are removed when it is exceeded.
_MAX_FIGHTS = 1_000


def silent_edge_ended(edge: MovingHistory, parent: str, child: str, stamp: int,
                      authority: str) -> Incident:
    """Return the incident of a new edge that reverses a silent one."""
    assert edge.latest_stamp is not None
    return Incident(
        Kind.SILENT_EDGE_ENDED, parent, child, stamp, authority,
        f'it reverses the edge {edge.parent!r} -> {edge.child!r} from '
        f'{edge.authority!r}, whose newest sample is '
        f'{format_span(stamp - edge.latest_stamp)} older; that edge ends there, and its past '
        'is still available')


def loop_closed(loop: Loop, child: str, stamp: int, authority: str) -> Incident:
    """Return the incident of an edge that was refused because it would close a loop."""
    parent = loop.edges[0].child
    way = ' -> '.join([child, parent, *loop.frames])
    kept = ', '.join(f'{above!r} -> {edge.child!r} from {edge.authority!r}'
                     for edge, above in zip(*loop, strict=True))
    return Incident(
        Kind.LOOP, parent, child, stamp, authority,
        f'each frame the child of the next, {way} is a loop; kept: {kept}. '
        'Two nodes disagree about which frame is the parent: stop one of the publishers')


def too_old(history: History, parent: str, stamp: int, authority: str,
            cache_time: int) -> Incident:
    """Return the incident of a sample that was refused because it is older than the window."""
    assert history.latest_stamp is not None
    return Incident(
        Kind.OLD_DATA, parent, history.child, stamp, authority,
        f'its stamp {format_stamp(stamp)} is {format_span(history.latest_stamp - stamp)} '
        f'older than the newest, {format_stamp(history.latest_stamp)}, and the buffer keeps '
        f'{format_span(cache_time)}; the last publisher was {history.authority!r}',
        history.latest_stamp)


class Remarks:
    """The incidents of accepted samples; each conflict about a parent is reported once."""

    def __init__(self) -> None:
        self._fights: set[tuple[str, str]] = set()

    def on(self, history: History | None, parent: str, child: str, stamp: int,
           authority: str, kind: str) -> list[Incident]:
        """Return remarks on an accepted sample; each conflict about a parent only once."""
        if history is None or history.parent is None:
            return []
        remarks = []
        if history.kind != kind:
            remarks.append(Incident(
                Kind.KIND_CHANGE, parent, child, stamp, authority,
                f'it was {history.kind} from {history.authority!r} and is now {kind}; '
                'its stored samples were removed'))
        if history.parent != parent and (child, parent) not in self._fights and (
                history.authority != authority or _goes_back(history, parent, authority)):
            if len(self._fights) > _MAX_FIGHTS:
                self._fights.clear()
            self._fights |= {(child, parent), (child, history.parent)}
            remarks.append(Incident(
                Kind.SECOND_PARENT, parent, child, stamp, authority,
                f'{history.authority!r} says that its parent is {history.parent!r}; '
                'as long as both continue, every lookup through it depends on which message came '
                'last'))
        return remarks


def _goes_back(history: History, parent: str, authority: str) -> bool:
    """Return whether a frame returns to a parent, possibly because of several publishers."""
    return (is_ambiguous(authority) and moves(history)
            and history.has_named(parent))
