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

"""Who sends, and who hears it."""

from collections.abc import Iterator

from .case import Case
from .check import check, names_of, of_edge, of_trouble, Remark
from .finding import Severity
from ..arrivals.incidents import Kind
from ..arrivals.received import Endpoint
from ..text import times
from ..vitals.edge import MovingEdge

# Two publishers whose values disagree make the frame go to and fro. Noise alone does that too, but
# most steps of noise are not taken back by the next one. A vibration, or a digit that flickers,
# looks the same. But the stamps of one publisher are regular, and those of two interleave.
_TURNS = 5
_PART = 0.35
_INTERLEAVED = 0.3


@check(Severity.ERROR, textbook=True,
       explains=('pose_jump', 'interpolated_jump', 'out_of_order', 'duplicate_stamps',
                 'irregular_rate', 'jump_back', 'gap', 'static_changed'),
       catches='one edge that two publishers send',
       cause='a node that was started twice, or two that both think the edge is theirs, such as '
             'wheel odometry and a filter that publishes its result',
       fix='stop one of them: every lookup depends on who came last')
def two_publishers(case: Case) -> Iterator[Remark]:
    """Find edges of two publishers: by the numbers of their messages, or by alternating values."""
    known = set()
    for frames, trouble in case.of_kind(Kind.TWO_PUBLISHERS):
        known.add(frames)
        yield of_trouble(frames, f'{frames[0]} -> {frames[1]}: {trouble.detail}', trouble)
    for edge, moving in case.moving():
        if edge.frames not in known and _goes_to_and_fro(moving):
            motion = moving.motion
            yield of_edge(
                edge, f'goes to and fro {times(motion.turns)}, by '
                f'{motion.size_of_turns.median:.3g} (metres and radians together), as if two '
                f'sent it; {moving.timing.rate_hz:.1f} Hz in all',
                {'count': motion.turns, 'samples': moving.timing.count,
                 'apart_m': motion.size_of_turns.median, 'rate_hz': moving.timing.rate_hz})


def _goes_to_and_fro(moving: MovingEdge) -> bool:
    motion, timing = moving.motion, moving.timing
    if motion.turns < _TURNS or motion.turns < _PART * motion.large:
        return False
    short, usual, long = timing.intervals.at(0.1, 0.5, 0.9)
    return timing.differing >= _TURNS or long - short > _INTERLEAVED * usual


@check(Severity.ERROR, textbook=True,
       catches='a publisher of static transforms that is not transient local',
       cause='a node that publishes on /tf_static by hand, or a bridge or a player with its own '
             'quality of service',
       fix='let it publish transient local, as StaticTransformBroadcaster does: whoever starts '
           'after it never hears of these edges')
def late_joiner(case: Case) -> Iterator[Remark]:
    """Find volatile publishers of static topics."""
    for one in case.endpoints:
        if one.publishes and _is_late_joiners(one):
            yield Remark(f'{_named(one)} publishes {one.topic} and is not transient local', (),
                         names_of([one.node]), {'publishers': 1})


@check(Severity.ERROR,
       catches='a publisher and a subscription of transforms whose quality of service does not '
               'match, so that nothing arrives',
       cause='a publisher that is best effort, where tf2 listens reliably',
       fix='let it publish reliably: /tf reliable and volatile, /tf_static reliable and '
           'transient local')
def qos_mismatch(case: Case) -> Iterator[Remark]:
    """Compare publishers with their subscriptions, and with what every listener asks for."""
    for publisher in case.endpoints:
        if not publisher.publishes or _is_late_joiners(publisher):
            continue
        deaf = [other for other in case.endpoints if _is_deaf(other, publisher)]
        standard = Endpoint(publisher.topic, publisher.static, '', False, True, publisher.static)
        if deaf or _is_deaf(standard, publisher):
            heard = f', and {len(deaf)} who listen do not hear it' if deaf else ''
            yield Remark(
                f'{_named(publisher)} publishes {publisher.topic} '
                f'{"reliably" if publisher.reliable else "as best effort"}'
                f'{"" if publisher.transient_local else " and volatile"}{heard}', (),
                names_of([publisher.node, *(other.node for other in deaf)]),
                {'deaf': len(deaf)})


def _is_late_joiners(publisher: Endpoint) -> bool:
    return publisher.static and not publisher.transient_local


def _is_deaf(hearer: Endpoint, publisher: Endpoint) -> bool:
    return (hearer.topic == publisher.topic and not hearer.publishes
            and (hearer.reliable > publisher.reliable
                 or hearer.transient_local > publisher.transient_local))


def _named(endpoint: Endpoint) -> str:
    return endpoint.node or 'somebody'
