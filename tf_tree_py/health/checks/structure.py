# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the structure of the tree: frame names, parents, publishers, and sources."""

from collections.abc import Iterator, Sequence
import re

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.core.stamp import format_span, from_seconds
from tf_tree_py.core.text import listed, shorten

from .case import Case
from .clocks import overlap, was_short
from .finding import (
    authorities_of,
    check,
    names_of,
    of_edge,
    of_edges,
    of_trouble,
    Remark,
    Severity,
    times,
)
from .pieces import are_robots
from ..measures.edge_record import EdgeRecord, MovingEdge

_SEPARATOR = re.compile(r'(?<![0-9])[\W_]+|[\W_]+(?![0-9])')


def _likeness(name: str) -> str:
    """Return a name in lower case, without blanks and separators."""
    # A separator between two digits is kept: link_1_1 is not link_11.
    return _SEPARATOR.sub('', name.casefold())


@check(Severity.WARNING,
       catches='names that differ only in case, separators or blanks: base_link and baselink',
       cause='the same frame is spelled in two ways, such as in a URDF and in a parameter file',
       fix='use one spelling; if they are two frames, give them names that differ')
def similar_names(case: Case) -> Iterator[Remark]:
    """Find frames whose names have the same likeness."""
    alike: dict[str, list[str]] = {}
    for frame in case.frames:
        alike.setdefault(_likeness(frame), []).append(frame)
    for names in alike.values():
        if len(names) > 1:
            edges = [edge for edge in case.edges if {*edge.frames} & {*names}]
            spellings = listed([repr(name) for name in names])
            pieces = sum(any(name in tree for name in names) for tree in case.trees)
            yield Remark(
                f'{spellings} look like one frame' + (
                    ', and their trees are not connected' if pieces > 1 else ''),
                tuple(names), authorities_of(*edges), {'names': len(names), 'trees': pieces},
                severity=Severity.ERROR if pieces > 1 else None)


@check(Severity.WARNING,
       catches='names that are published with a leading slash',
       cause='a node or a tf_prefix that was written for ROS 1',
       fix='omit the slash: buffers remove it from received names, and refuse it in a lookup')
def leading_slash(case: Case) -> Iterator[Remark]:
    """Find names that were received with a leading slash."""
    if case.slashed:
        names = tuple(sorted(case.slashed))
        bare = {name.removeprefix('/') for name in names}
        edges = [edge for edge in case.edges if {*edge.frames} & bare]
        yield Remark(f'published with a leading slash: {listed(names)}', names,
                     authorities_of(*edges), {'names': len(names)})


@check(Severity.ERROR,
       catches='a transform with an empty frame name',
       cause='a message whose header.frame_id or child_frame_id was not set',
       fix='set both names; every buffer refuses such a transform')
def empty_name(case: Case) -> Iterator[Remark]:
    """Find transforms that the buffer refused for an empty name."""
    for (parent, child), trouble in case.of_kind(Kind.EMPTY_FRAME):
        frames = tuple(name for name in (parent, child) if name)
        beside = f'beside {frames[0]}' if frames else 'on both sides'
        yield of_trouble(frames, f'an empty frame name {beside}, {times(trouble.count)}', trouble)


# --- publishers

# If this many edges and no others have two publishers, everything was started twice.
_ALL = 3


@check(Severity.ERROR, textbook=True,
       explains=('out_of_order', 'duplicate_stamps', 'irregular_rate', 'too_fast', 'outlier',
                 'pose_jump', 'interpolated_jump'),
       catches='one edge that two publishers send',
       cause='a node that was started twice, two nodes that both publish the edge, such as wheel '
             'odometry and a filter that publishes its result, or one node that publishes two '
             'estimates in turn',
       fix='stop one of them: every lookup depends on which message came last')
def two_publishers(case: Case) -> Iterator[Remark]:
    """Find edges of two publishers by their message numbers or by alternating values."""
    known = {frames for frames, _ in case.of_kind(Kind.TWO_PUBLISHERS)}
    twice = overlap(moving for _, moving in case.moving())
    seen = [(edge, moving) for edge, moving in case.moving()
            if edge.frames not in known and moving.motion.turns.intervals
            and not (twice and was_short(moving)) and not _is_of_overlap(case, moving)]
    both = known | {edge.frames for edge, _ in seen}
    all_moving = [edge for edge, moving in case.moving() if moving.motion.moved]
    if len(all_moving) >= _ALL and {edge.frames for edge in all_moving} <= both:
        yield _two_robots(all_moving)
        return
    for frames, trouble in case.of_kind(Kind.TWO_PUBLISHERS):
        yield of_trouble(frames, f'{frames[0]} -> {frames[1]}: {trouble.detail}', trouble)
    for edge, moving in seen:
        yield _alternating(edge, moving)


def _is_of_overlap(case: Case, moving: MovingEdge) -> bool:
    """Return whether an edge only alternated while the clock of the arrivals ran twice."""
    step, turns = case.arrival_step, moving.motion.turns
    return step is not None and step.step < 0 and (
        step.received + step.step - _ROUND <= turns.first
        and turns.last <= step.received + _ROUND)


def _alternating(edge: EdgeRecord, moving: MovingEdge) -> Remark:
    turns = moving.motion.turns
    assert turns.intervals is not None
    each = ' and '.join(f'every {format_span(round(one))}' for one in turns.intervals)
    return of_edge(
        edge, f'alternates between two poses {times(turns.all)}, by {turns.sizes.median:.3g} '
        f'(metres and radians together), as two publishers do that send {each}; '
        f'{moving.timing.rate_hz:.1f} Hz in all',
        {'count': turns.all, 'samples': moving.timing.count, 'apart_m': turns.sizes.median,
         'rate_hz': moving.timing.rate_hz})


def _two_robots(edges: Sequence[EdgeRecord]) -> Remark:
    return of_edges(
        edges, f'all {len(edges)} edges that move have two publishers, such as {edges[0]}: two '
        'robots with the same frame names send on one topic', {'edges': len(edges)},
        cause='two robots or simulations share a ROS_DOMAIN_ID and a network; or a recording is '
              'played beside the robot; or everything was launched twice',
        fix='give each robot a ROS_DOMAIN_ID, or a namespace for /tf and a prefix for its frames; '
            'stop what was started twice')


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
            # An edge of one of several nodes may well have arrived from another.
            edges = [edge for edge in case.edges if edge.fixed is not None
                     and (not one.node or names_of(edge.authorities) == names_of([one.node]))]
            frames = dict.fromkeys(frame for edge in edges for frame in edge.frames)
            its_edges = f', with {listed([str(edge) for edge in edges])}' if edges else ''
            yield Remark(f'{_named(one)} publishes {one.topic} as volatile{its_edges}: listeners '
                         'of tf2 do not receive it', tuple(frames), [one.node],
                         {'publishers': 1, 'edges': len(edges)})


@check(Severity.ERROR,
       catches='a publisher and a subscription of transforms whose quality of service does not '
               'match, so that nothing arrives',
       cause='a best-effort publisher: the listeners of tf2 request reliable transforms',
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
                [publisher.node, *(other.node for other in deaf)],
                {'deaf': len(deaf)})


def _is_late_joiners(publisher: Endpoint) -> bool:
    return publisher.static and not publisher.transient_local


def _is_deaf(hearer: Endpoint, publisher: Endpoint) -> bool:
    return (hearer.topic == publisher.topic and not hearer.publishes
            and (hearer.reliable > publisher.reliable
                 or hearer.transient_local > publisher.transient_local))


def _named(endpoint: Endpoint) -> str:
    return endpoint.node or 'an unknown node'


# --- sources

@check(Severity.WARNING,
       explains=('gap', 'irregular_rate'),
       catches='a source of an edge that fell silent and was replaced by another',
       cause='its node or its sensor has died, or hangs; or its clock is behind the others',
       fix='check that source. The edge continued without a jump. When the source works again, '
           'switch back to it; with prefer the buffer does so itself')
def source_silent(case: Case) -> Iterator[Remark]:
    """Find the incidents of a buffer, here or from the diagnostics of another process."""
    yield from _made_way(case, Kind.SOURCE_SILENT)


@check(Severity.WARNING,
       explains=('pose_jump',),
       catches='a source that moved differently from the others of its edge, and was replaced',
       cause='wheels that slip, a camera that lost its features, a calibration that is off',
       fix='check that source. Its earlier errors stay in the pose until a localisation corrects '
           'them')
def source_diverged(case: Case) -> Iterator[Remark]:
    """Find the incidents, as ``source_silent`` does."""
    yield from _made_way(case, Kind.SOURCE_DIVERGED)


def _made_way(case: Case, kind: Kind) -> Iterator[Remark]:
    for frames, trouble in case.of_kind(kind):
        yield of_trouble(frames, f'{frames[0]} -> {frames[1]} changed its source '
                         f'{times(trouble.count)}: {trouble.detail}', trouble)


# --- the tree

# A frame that is handed over has one parent for a while, and then another. In a conflict its
# parent changes with every other message.
_FIGHT = 3
_ROUND = from_seconds(1.0)


@check(Severity.ERROR, textbook=True,
       catches='an edge that would close a loop, so that a frame would be its own ancestor',
       cause='two nodes disagree about which frame is the parent; often a localiser that '
             'publishes map -> base_link in addition to an odometry, or an inverted transform',
       fix='stop one of the two senders, or let it publish the inverse')
def loop(case: Case) -> Iterator[Remark]:
    """Find edges that the buffer refused because they would close a loop."""
    for edge, trouble in case.of_kind(Kind.LOOP):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} would close a loop, and was refused '
                         f'{times(trouble.count)}: {trouble.detail}', trouble)


@check(Severity.ERROR, textbook=True,
       catches='a frame that constantly gets two different parents',
       cause='two nodes publish the frame, such as a localiser that should publish '
             'map -> odom and publishes map -> base_link',
       fix='decide which node publishes the frame, and stop the other')
def two_parents(case: Case) -> Iterator[Remark]:
    """Find children that alternate between parents, or that have two parents and a static edge."""
    for child, edges in case.above.items():
        # A static edge is valid at all times, and so in conflict with any other.
        if len(edges) < 2 or not (_fights(case, child, edges)
                                  or any(edge.fixed for edge in edges)):
            continue
        parents = tuple(edge.parent for edge in edges)
        switches = case.parents[child].switches
        yield Remark(
            f'{shorten(child, 80)} has the parents {listed(parents)}, and changed between them '
            f'{times(switches)}', (*parents, child), authorities_of(*edges),
            {'parents': len(parents), 'switches': switches},
            edges=tuple(edge.frames for edge in edges))
    for (parent, child), trouble in case.of_kind(Kind.NOT_ITS_OWN):
        yield of_trouble(
            (parent, child), f'{shorten(child, 80)} was given the parent {shorten(parent, 80)}, '
            f'and that was refused {times(trouble.count)}: {trouble.detail}', trouble,
            severity=Severity.WARNING, cause='a robot of a fleet publishes a frame that all '
            'robots share', fix='do not publish that edge on the robot')


def _fights(case: Case, child: str, edges: list[EdgeRecord]) -> bool:
    changed = case.parents[child]
    if changed.switches < _FIGHT:
        return False
    # Each time that it comes, the slower one of two is soon followed by the other again.
    counts = sorted(edge.moving.timing.count for edge in edges if edge.moving)
    slow = len(counts) > 1 and counts[0] < changed.switches < counts[-1]
    return slow or changed.last - changed.first < (changed.switches - 1) * _ROUND


@check(Severity.ERROR, textbook=True,
       catches='frames that no lookup can connect, because they are in different trees',
       cause='the edge between the trees is not published: its node does not run, waits for '
             'something, or uses another name or prefix for the frame',
       fix='find out which node should publish an edge between the two roots, and start it',
       recorded_fix='no lookup from one tree to the other works in this recording. Find out which '
                    'node publishes an edge between the two roots, and start it before the next')
def unconnected(case: Case) -> Iterator[Remark]:
    """Find trees besides the largest; robots with prefixes of their own are only a note."""
    trees = case.trees
    known = {_likeness(frame) for frame in trees[0]} if trees else set()
    for tree in trees[1:]:
        if any(_likeness(frame) in known for frame in tree):
            continue  # similar_names reports it: equal names would join the trees
        roots = tuple(frame for one in (trees[0], tree) for frame in one if frame in case.roots)
        edges = [edge for frame in tree for edge in case.above.get(frame, ())]
        yield Remark(
            f'{_in_words(tree)} are not connected with {_in_words(trees[0])}', roots,
            authorities_of(*edges), {'trees': len(trees), 'frames': len(tree)},
            Severity.NOTE if are_robots(trees) else None)


def _in_words(tree: list[str]) -> str:
    return f'{shorten(tree[0], 80)} and {len(tree) - 1} more frames'


@check(Severity.ERROR,
       catches='a transform from a frame to itself',
       cause='header.frame_id and child_frame_id were set from the same parameter',
       fix='use two different names; every buffer refuses such a transform')
def self_edge(case: Case) -> Iterator[Remark]:
    """Find edges from a frame to itself; the buffer refused them."""
    for edge, trouble in case.of_kind(Kind.SELF_EDGE):
        yield of_trouble(edge[:1], f'{edge[0]} was published as its own parent '
                         f'{times(trouble.count)}', trouble)
