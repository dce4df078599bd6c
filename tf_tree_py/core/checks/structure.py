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

"""Which frame hangs on which."""

from collections.abc import Iterator

from .case import Case
from .check import check, of_trouble, publishers_of, Remark
from .finding import Severity
from .names import likeness
from ..arrivals.incidents import Kind
from ..stamp import from_seconds
from ..text import listed, shorten, times
from ..vitals.edge import EdgeRecord

# A frame that is handed over is the child of one parent for a while, and then of the other. In a
# fight it changes its parent with every other message.
_FIGHT = 3
_ROUND = from_seconds(1.0)


@check(Severity.ERROR, textbook=True,
       explains=('two_publishers', 'delayed', 'static_republished', 'gap', 'irregular_rate',
                 'skew'),
       catches='an edge that would close a loop: each frame of it the child of the next',
       cause='two nodes disagree about who is whose parent; often a localiser that publishes '
             'map -> base_link beside an odometry, or an inverted transform',
       fix='stop one of the two senders, or let it publish the inverse')
def loop(case: Case) -> Iterator[Remark]:
    """Find edges that the buffer refused because they would close a loop."""
    for edge, trouble in case.of_kind(Kind.LOOP):
        yield of_trouble(edge, f'{edge[0]} -> {edge[1]} would close a loop, and was refused '
                         f'{times(trouble.count)}: {trouble.detail}', trouble)


@check(Severity.ERROR, textbook=True,
       explains=('two_publishers', 'pose_jump', 'interpolated_jump', 'irregular_rate',
                 'static_changed', 'kind_flips', 'gap', 'out_of_order'),
       catches='a frame to which two parents are given all the time',
       cause='two nodes claim the frame, such as a localiser that should publish '
             'map -> odom and publishes map -> base_link',
       fix='decide who owns the frame, and stop the other')
def two_parents(case: Case) -> Iterator[Remark]:
    """Find children that change to and fro between parents, or that are static below two."""
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
            (parent, child), f'{shorten(child, 80)} was hung on {shorten(parent, 80)}, and that '
            f'was refused {times(trouble.count)}: {trouble.detail}', trouble,
            severity=Severity.WARNING, cause='a robot of a fleet says where a frame is that all '
            'robots share', fix='leave that edge out on the robot')


def _fights(case: Case, child: str) -> bool:
    changed = case.parents[child]
    return (changed.switches >= _FIGHT
            and changed.last - changed.first < (changed.switches - 1) * _ROUND)


def _is_fixed_twice(edges: list[EdgeRecord]) -> bool:
    """Return whether one of several edges to a child is static, and none of them has ended."""
    fixed = [edge for edge in edges if edge.fixed]
    return len(fixed) > 1 or bool(fixed and any(edge.moving for edge in edges))


@check(Severity.WARNING, textbook=True,
       catches='frames that no lookup can join, because they are in different trees',
       cause='the edge between the trees is not published: its node does not run, waits for '
             'something, or uses another name or prefix for the frame',
       fix='find out who should publish an edge between the two roots, and start it')
def unconnected(case: Case) -> Iterator[Remark]:
    """Find trees beside the largest; a robot with a prefix of its own is only a note."""
    trees = case.trees
    prefixes = [_prefix(tree) for tree in trees]
    of_robots = len(set(prefixes)) == len(trees) and '' not in prefixes
    known = {likeness(frame) for frame in trees[0]} if trees else set()
    for tree in trees[1:]:
        if any(likeness(frame) in known for frame in tree):
            continue  # they are joined once the names agree
        roots = tuple(frame for one in (trees[0], tree) for frame in one if frame in case.roots)
        edges = [edge for frame in tree for edge in case.above.get(frame, ())]
        yield Remark(
            f'{_in_words(tree)} are not connected with {_in_words(trees[0])}', roots,
            publishers_of(*edges), {'trees': len(trees), 'frames': len(tree)},
            Severity.NOTE if of_robots else None)


def _in_words(tree: list[str]) -> str:
    return f'{shorten(tree[0], 80)} and {len(tree) - 1} more frames'


def _prefix(tree: list[str]) -> str:
    """Return the prefix that all frames of a tree have, such as ``robot1``; '' for none."""
    prefixes = {frame.partition('/')[0] if '/' in frame else '' for frame in tree}
    return prefixes.pop() if len(prefixes) == 1 else ''


@check(Severity.ERROR,
       catches='a transform from a frame to itself',
       cause='header.frame_id and child_frame_id were set from the same parameter',
       fix='set the two names apart; every buffer refuses such a transform')
def self_edge(case: Case) -> Iterator[Remark]:
    """Find edges from a frame to itself; the buffer refused them."""
    for edge, trouble in case.of_kind(Kind.SELF_EDGE):
        yield of_trouble(edge[:1], f'{edge[0]} was published as its own parent '
                         f'{times(trouble.count)}', trouble)
