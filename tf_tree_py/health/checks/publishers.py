# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of publishers and subscriptions."""

from collections.abc import Iterator

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.core.text import listed, times

from .case import Case
from .check import check, names_of, of_edge, of_trouble, Remark
from .clocks import was_short
from .finding import Severity
from ..measures.edge_record import MovingEdge

# Two publishers that disagree make the frame alternate between two poses. Noise does so too, but
# the next step reverses few of its steps. A vibration, or a toggling last digit, looks the same.
# But the stamps of one publisher are regular, while those of two interleave: a sample of the
# second lies between two of the first, whereas an outlier replaces a sample.
_TURNS = 5
_PART = 0.35
_INTERLEAVED = 0.3
_BETWEEN = 1.5
# Two publishers that alternate exactly differ by a nearly constant amount; the amplitude of a
# similar vibration varies.
_ALWAYS, _SAME_SIZE, _APART = 0.7, 0.5, 0.02


@check(Severity.ERROR, textbook=True,
       explains=('pose_jump', 'interpolated_jump', 'out_of_order', 'duplicate_stamps',
                 'irregular_rate', 'gap', 'static_changed', 'outlier', 'too_fast'),
       catches='one edge that two publishers send',
       cause='a node that was started twice, or two nodes that both publish the edge, such as '
             'wheel odometry and a filter that publishes its result',
       fix='stop one of them: every lookup depends on which message came last')
def two_publishers(case: Case) -> Iterator[Remark]:
    """Find edges of two publishers by their message numbers or by alternating values."""
    known = set()
    for frames, trouble in case.of_kind(Kind.TWO_PUBLISHERS):
        known.add(frames)
        yield of_trouble(frames, f'{frames[0]} -> {frames[1]}: {trouble.detail}', trouble)
    for edge, moving in case.moving():
        if edge.frames not in known and _goes_to_and_fro(moving):
            turns = moving.motion.turns
            yield of_edge(
                edge, f'alternates between two poses {times(turns.count)}, by '
                f'{turns.sizes.median:.3g} (metres and radians together), as if it had two '
                f'publishers; {moving.timing.rate_hz:.1f} Hz in all',
                {'count': turns.count, 'samples': moving.timing.count,
                 'apart_m': turns.sizes.median, 'rate_hz': moving.timing.rate_hz})


def _goes_to_and_fro(moving: MovingEdge) -> bool:
    turns, timing = moving.motion.turns, moving.timing
    if turns.count < _TURNS or turns.count < _PART * turns.large or was_short(moving):
        return False
    small, large = turns.sizes.at(0.1, 0.9)
    if (turns.count > _ALWAYS * moving.motion.steps and small > _SAME_SIZE * large
            and turns.sizes.median > _APART):
        return True
    short, usual, long = timing.intervals.at(0.1, 0.5, 0.9)
    return timing.differing >= _TURNS or (
        long - short > _INTERLEAVED * usual and turns.spans.median < _BETWEEN * long)


@check(Severity.ERROR, textbook=True,
       catches='a publisher of static transforms that is not transient local',
       cause='a node that publishes on /tf_static by hand, or a bridge or a player with its own '
             'quality of service',
       fix='let it publish transient local, as StaticTransformBroadcaster does. All listeners of '
           'tf2 request that, so they never match this publisher, even if they start earlier')
def late_joiner(case: Case) -> Iterator[Remark]:
    """Find volatile publishers of static topics."""
    for one in case.endpoints:
        if one.publishes and _is_late_joiners(one):
            edges = [edge for edge in case.edges if edge.fixed is not None
                     and (not one.node or one.node in names_of(edge.authorities))]
            frames = dict.fromkeys(frame for edge in edges for frame in edge.frames)
            told = f', with {listed([str(edge) for edge in edges])}' if edges else ''
            yield Remark(f'{_named(one)} publishes {one.topic} as volatile{told}: listeners '
                         'of tf2 do not receive it', tuple(frames), names_of([one.node]),
                         {'publishers': 1, 'edges': len(edges)})


@check(Severity.ERROR,
       catches='a publisher and a subscription of transforms whose quality of service does not '
               'match, so that nothing arrives',
       cause='a publisher that is best effort, where tf2 listens reliably',
       fix='let it publish reliably: /tf reliable and volatile, /tf_static reliable and '
           'transient local')
def qos_mismatch(case: Case) -> Iterator[Remark]:
    """Compare publishers with their subscriptions, and with tf2's standard requests."""
    for publisher in case.endpoints:
        if not publisher.publishes or _is_late_joiners(publisher):
            continue
        deaf = [other for other in case.endpoints if _is_deaf(other, publisher)]
        standard = Endpoint(publisher.topic, publisher.static, '', False, True, publisher.static)
        if deaf or _is_deaf(standard, publisher):
            heard = (f', and {len(deaf)} subscription{"s do" if len(deaf) > 1 else " does"} not '
                     'receive it' if deaf else '')
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
    return endpoint.node or 'an unknown node'
