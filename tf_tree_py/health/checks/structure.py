# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Checks of the structure of the tree."""

from collections.abc import Iterator

from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.core.text import listed, shorten, times

from .case import Case
from .check import check, of_trouble, publishers_of, Remark
from .finding import Severity
from .frame_name_checks import likeness
from ..measures.edge_record import EdgeRecord
from ..measures.pieces import are_robots

# A frame that is handed over has one parent for a while, and then another. In a conflict its
# parent changes with every other message.
_FIGHT = 3
_ROUND = from_seconds(1.0)


@check(Severity.ERROR, textbook=True,
       explains=('two_publishers', 'delayed', 'static_republished', 'gap', 'irregular_rate',
                 'skew', 'stale'),
       catches='an edge that would close a loop: each frame of it the child of the next',
       cause='two nodes disagree about which frame is the parent; often a localiser that '
             'publishes map -> base_link in addition to an odometry, or an inverted transform',
       fix='stop one of the two senders, or let it publish the inverse')
def loop(case: Case) -> Iterator[Remark]:
    """Find edges that the buffer refused because they would close a loop."""
    for edge, trouble in case.of_kind(Kind.LOOP):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} would close a loop, and was refused '
                         f'{times(trouble.count)}: {trouble.detail}', trouble)


@check(Severity.ERROR, textbook=True,
       explains=('two_publishers', 'pose_jump', 'interpolated_jump', 'irregular_rate',
                 'static_changed', 'kind_flips', 'gap', 'out_of_order', 'stale'),
       catches='a frame that constantly gets two different parents',
       cause='two nodes publish the frame, such as a localiser that should publish '
             'map -> odom and publishes map -> base_link',
       fix='decide which node publishes the frame, and stop the other')
def two_parents(case: Case) -> Iterator[Remark]:
    """Find children that alternate between parents, or that have two parents and a static edge."""
    for child, edges in case.above.items():
        if len(edges) < 2 or not (_fights(case, child) or _is_fixed_twice(edges)):
            continue
        parents = tuple(edge.parent for edge in edges)
        switches = case.parents[child].switches
        yield Remark(
            f'{shorten(child, 80)} has the parents {listed(parents)}, and changed between them '
            f'{times(switches)}', (*parents, child), publishers_of(*edges),
            {'parents': len(parents), 'switches': switches})
    for (parent, child), trouble in case.of_kind(Kind.NOT_ITS_OWN):
        yield of_trouble(
            (parent, child), f'{shorten(child, 80)} was given the parent {shorten(parent, 80)}, '
            f'and that was refused {times(trouble.count)}: {trouble.detail}', trouble,
            severity=Severity.WARNING, cause='a robot of a fleet publishes a frame that all '
            'robots share', fix='do not publish that edge on the robot')


def _fights(case: Case, child: str) -> bool:
    changed = case.parents[child]
    return (changed.switches >= _FIGHT
            and changed.last - changed.first < (changed.switches - 1) * _ROUND)


def _is_fixed_twice(edges: list[EdgeRecord]) -> bool:
    """Return whether a child has several static edges, or a static and a moving one."""
    fixed = [edge for edge in edges if edge.fixed]
    return len(fixed) > 1 or bool(fixed and any(edge.moving for edge in edges))


@check(Severity.ERROR, textbook=True,
       catches='frames that no lookup can connect, because they are in different trees',
       cause='the edge between the trees is not published: its node does not run, waits for '
             'something, or uses another name or prefix for the frame',
       fix='find out which node should publish an edge between the two roots, and start it')
def unconnected(case: Case) -> Iterator[Remark]:
    """Find trees besides the largest; robots with prefixes of their own are only a note."""
    trees = case.trees
    known = {likeness(frame) for frame in trees[0]} if trees else set()
    for tree in trees[1:]:
        if any(likeness(frame) in known for frame in tree):
            continue  # similar_names reports it: equal names would join the trees
        roots = tuple(frame for one in (trees[0], tree) for frame in one if frame in case.roots)
        edges = [edge for frame in tree for edge in case.above.get(frame, ())]
        yield Remark(
            f'{_in_words(tree)} are not connected with {_in_words(trees[0])}', roots,
            publishers_of(*edges), {'trees': len(trees), 'frames': len(tree)},
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
