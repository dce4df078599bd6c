# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
The incidents of samples that change the tree, or that must not change it.

The sentences are here; the rules are in ``tree``.
"""

from .climb import Loop
from ..arrivals.incidents import Incident, is_ambiguous, Kind
from ..edges.protocol import History, moves, MovingHistory
from ..stamp import format_span, format_stamp

# Fights that were reported: all are forgotten at this number.
_MAX_FIGHTS = 1_000


def silent_edge_ended(edge: MovingHistory, parent: str, child: str, stamp: int,
                      authority: str) -> Incident:
    """Return the incident of a new edge that turns a silent one round."""
    assert edge.latest_stamp is not None
    return Incident(
        Kind.SILENT_EDGE_ENDED, parent, child, stamp, authority,
        f'it turns round the edge {edge.parent!r} -> {edge.child!r} from '
        f'{edge.authority!r}, whose newest sample is '
        f'{format_span(stamp - edge.latest_stamp)} older; that edge ended with it, and its '
        'past can still be asked for')


def loop_closed(loop: Loop, child: str, stamp: int, authority: str) -> Incident:
    """Return the incident of an edge that was refused because it would close a loop."""
    parent = loop.edges[0].child
    way = ' -> '.join([child, parent, *loop.frames])
    kept = ', '.join(f'{above!r} -> {edge.child!r} from {edge.authority!r}'
                     for edge, above in zip(*loop, strict=True))
    return Incident(
        Kind.LOOP, parent, child, stamp, authority,
        f'each frame the child of the next, {way} is a loop; kept: {kept}. '
        'Two nodes disagree about who is whose parent: stop the sender of this, or the other')


def too_old(history: History, parent: str, stamp: int, authority: str,
            cache_time: int) -> Incident:
    """Return the incident of a sample that was refused because it is older than the window."""
    assert history.latest_stamp is not None
    return Incident(
        Kind.OLD_DATA, parent, history.child, stamp, authority,
        f'its stamp {format_stamp(stamp)} is {format_span(history.latest_stamp - stamp)} '
        f'older than the newest, {format_stamp(history.latest_stamp)}, and the buffer keeps '
        f'{format_span(cache_time)}; the last one heard was {history.authority!r}',
        history.latest_stamp)


class Remarks:
    """The incidents of samples that are taken; each fight over a parent is told once."""

    def __init__(self) -> None:
        self._fights: set[tuple[str, str]] = set()

    def on(self, history: History | None, parent: str, child: str, stamp: int,
           authority: str, kind: str) -> list[Incident]:
        """Return remarks on a sample that is taken; each fight over a parent only once."""
        if history is None or history.parent is None:
            return []
        remarks = []
        if history.kind != kind:
            remarks.append(Incident(
                Kind.KIND_CHANGE, parent, child, stamp, authority,
                f'it was {history.kind} from {history.authority!r} and is now {kind}; '
                'what was stored of it is gone'))
        if history.parent != parent and (child, parent) not in self._fights and (
                history.authority != authority or _goes_back(history, parent, authority)):
            if len(self._fights) > _MAX_FIGHTS:
                self._fights.clear()
            self._fights |= {(child, parent), (child, history.parent)}
            remarks.append(Incident(
                Kind.SECOND_PARENT, parent, child, stamp, authority,
                f'{history.authority!r} says that its parent is {history.parent!r}; '
                'while both go on, every lookup through it depends on who came last'))
        return remarks


def _goes_back(history: History, parent: str, authority: str) -> bool:
    """Return whether a frame returns to a parent and several publishers may be behind it."""
    return (is_ambiguous(authority) and moves(history)
            and history.has_named(parent))
