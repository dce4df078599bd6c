# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the panels of a page say: facts about the chosen frame, and the list of frames.

The facts include the frame's motion in another one, as measured values and as data for plots. The
list is a tree, with a search and with folded subtrees.
"""

from collections.abc import Collection, Mapping, Sequence
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import EdgeInfo, Pose, TransformException
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_span, format_stamp, LATEST
from tf_tree_py.core.times import Stamps
from tf_tree_py.reports import explanation_text
from tf_tree_py.reports.explanation import explain, ExplainedEdge, Explanation

from .moment import links_of, Moment, reached

Fact = tuple[str, str]


def facts(tree: AllQueries, edges: Sequence[EdgeInfo], moment: Moment, frame: str) -> list[Fact]:
    """
    Return facts about a frame, as pairs of a name and a value.

    :param edges: of the tree, with their publishers.
    """
    place = moment.place(frame)
    stamp = moment.stamp if place is None else int(moment.stamps[place])
    explanation = explain(tree, moment.fixed_frame, frame, stamp, now=moment.stamp)
    own = next((edge for edge in edges if edge.child == frame), None)
    return [*_pose(moment, place, frame), *_edge(own), *_age(moment, place), *_path(explanation)]


def _pose(moment: Moment, place: int | None, frame: str) -> list[Fact]:
    if place is None:
        return [('pose', f'unknown in {moment.fixed_frame!r} at this stamp')]
    pose = Pose(*moment.poses[place].tolist())
    roll, pitch, yaw = (math.degrees(angle) for angle in pose.as_rpy())
    return [('position', '{:.4f}, {:.4f}, {:.4f} m'.format(*pose.translation)),
            ('roll, pitch, yaw', f'{roll:.2f}, {pitch:.2f}, {yaw:.2f} deg'),
            ('quaternion x y z w', ' '.join(f'{part:.4f}' for part in pose.rotation))]


def _edge(edge: EdgeInfo | None) -> list[Fact]:
    if edge is None:
        return [('parent', 'none: it is a root')]
    found = [('parent', edge.parent), ('publisher', edge.authority or 'unknown')]
    if edge.static:
        return [*found, ('kind', 'static')]
    rate = f'{1e9 / edge.interval:.1f} Hz' if edge.span else 'unknown: one sample'
    return [*found, ('rate', rate), ('samples', f'{edge.samples} in {format_span(edge.span)}')]


def _age(moment: Moment, place: int | None) -> list[Fact]:
    if place is None:
        return []
    stamp = int(moment.stamps[place])
    found = [] if stamp == LATEST else [('stamp', f'{format_stamp(stamp)} s')]
    if moment.ages[place]:
        found.append(('age', format_span(int(moment.ages[place]))))
    if moment.stale[place]:
        found.append(('stale', 'shown at its last known pose'))
    return found


def _path(explanation: Explanation) -> list[Fact]:
    """Return the edges to the fixed frame and their uncertainty; or why there is no path."""
    if explanation.pose is None:
        return [('why', explanation.problem)]
    path = [(f'{edge.info.parent} → {edge.info.child}', _of_edge(edge, explanation.stamp))
            for edge in explanation.edges]
    certainty = explanation.certainty
    if certainty is None:
        return path
    return [*path, ('sigma', explanation_text.sigma(certainty)),
            *((f'share of {edge}', part) for edge, part in explanation_text.shares(certainty))]


def _of_edge(edge: ExplainedEdge, stamp: int) -> str:
    if edge.info.static:
        return _joined(explanation_text.rate_of(edge), _sender(edge))
    apart = explanation_text.apart(edge)
    return _joined(explanation_text.rate_of(edge), _newest(edge.age),
                   explanation_text.around(edge, stamp), apart and f'{apart} apart', _sender(edge))


def _newest(age: int | None) -> str:
    if age is None:
        return ''
    return f'newest {format_span(abs(age))} {"after" if age < 0 else "before"} this'


def _sender(edge: ExplainedEdge) -> str:
    return edge.info.authority and f'from {edge.info.authority}'


def _joined(*parts: str) -> str:
    return ', '.join(filter(None, parts))


# --- relative motion

# The number of evenly spaced stamps, and the greatest number of the frame's own samples, which
# show jumps and gaps.
_EVEN, _OWN = 300, 900


class RelativeMotion(NamedTuple):
    """
    Poses of a frame in another one over time.

    :ivar stamps: (N,) nanoseconds, in order.
    :ivar positions: (N, 3) metres; NaN where there are no data.
    :ivar angles: (N, 3) roll, pitch and yaw, degrees, without jumps by a full turn; NaN where
        there are no data.
    """

    stamps: Stamps
    positions: Array
    angles: Array


def relative_motion(tree: AllQueries, target: str, frame: str, begin: int,
                    end: int) -> RelativeMotion | None:
    """
    Return the motion of a frame in another one between two stamps.

    :return: None: the frames are not connected.
    """
    stamps = _stamps(tree, frame, begin, end)
    try:
        poses, valid = tree.lookup_many(target, frame, stamps, outside='mask')
    except TransformException:
        return None
    positions = np.where(valid[:, None], poses[:, :3], np.nan)
    angles = np.full((len(stamps), 3), np.nan)
    angles[valid] = np.degrees(np.unwrap(
        [Pose(*pose).as_rpy() for pose in poses[valid].tolist()], axis=0)) if valid.any() else 0.0
    return RelativeMotion(stamps, positions, angles)


def _stamps(tree: AllQueries, frame: str, begin: int, end: int) -> Stamps:
    even = np.linspace(begin, end, _EVEN).round().astype(np.int64)
    own = np.asarray(tree.stamps_of(frame) if frame in tree.frames() else [], np.int64)
    own = own[(own >= begin) & (own <= end)]
    # Fewer samples keep the message to the browser short.
    thinned = own[::max(len(own) // _OWN, 1)]
    stamps: npt.NDArray[np.int64] = np.unique(np.concatenate([even, thinned]))
    return stamps[stamps > 0]


def measured(now: Pose | None, motion: RelativeMotion | None) -> list[Fact]:
    """Return measured values between two frames, now and over the window, as facts."""
    if now is None:
        return [('now', 'unknown at this stamp')]
    roll, pitch, yaw = np.degrees(now.as_rpy())
    distance = float(np.linalg.norm(now.translation))
    found = [('distance', f'{distance:.4f} m'),
             ('x, y, z', '{:.4f}, {:.4f}, {:.4f} m'.format(*now.translation)),
             ('roll, pitch, yaw', f'{roll:.2f}, {pitch:.2f}, {yaw:.2f} deg')]
    if motion is None or np.isnan(motion.positions).all():
        return found
    distances = np.linalg.norm(motion.positions, axis=1)
    return [*found, ('distance in the window', _range(distances, '.4f', 'm')),
            ('yaw in the window', _range(motion.angles[:, 2], '.2f', 'deg'))]


def _range(values: Array, form: str, unit: str) -> str:
    return f'{np.nanmin(values):{form}} to {np.nanmax(values):{form}} {unit}'


# --- the list of frames

# The longest list. A search finds the other frames.
MOST_ROWS = 150
# Fewer static frames than this are not folded.
_WORTH_A_FOLD = 4

Children = Mapping[str, Sequence[EdgeInfo]]


class FrameRow(NamedTuple):
    """
    One row of the list: a frame, or a line that stands for folded static frames.

    :ivar lead: the lines of the tree in front of the frame.
    :ivar static: whether its edge is static; None for a root.
    :ivar folds: None: the row is a frame. Else the text of a row that shows or hides the static
        frames below ``frame``.
    """

    frame: str
    lead: str
    static: bool | None
    folds: str | None = None


def rows(edges: Sequence[EdgeInfo], search: str = '',
         unfolded: Collection[str] | None = None) -> list[FrameRow]:
    """
    Return the rows of the list in the order of the tree, each child below its parent.

    :param search: list only frames whose names contain this text, in upper or lower case, and
        the frames above them.
    :param unfolded: frames whose static subtrees are listed. Large static subtrees of other
        frames are one row, unless the whole tree is static or there is a search. None: list
        all frames.
    """
    children: dict[str, list[EdgeInfo]] = {}
    for edge in edges:
        children.setdefault(edge.parent, []).append(edge)
    hung = {edge.child for edge in edges}
    part = search.strip().casefold()
    wanted = _found(edges, part)
    all_static = all(edge.static for edge in edges)
    folds = {} if unfolded is None or part or all_static else _folds(children)
    tree = _Tree(children, wanted, folds, unfolded or ())
    result: list[FrameRow] = []
    for root in dict.fromkeys(edge.parent for edge in edges if edge.parent not in hung):
        if root in wanted:
            result.append(FrameRow(root, '', None))
            result += tree.below(root)
    return result


def _found(edges: Sequence[EdgeInfo], part: str) -> Collection[str]:
    """Return the frames whose names contain a text, and all frames above them."""
    parents = {edge.child: [edge.parent] for edge in edges}
    frames = dict.fromkeys(name for edge in edges for name in (edge.parent, edge.child))
    return {above for frame in frames if part in frame.casefold()
            for above in reached(frame, parents)}


def _folds(children: Children) -> dict[str, dict[str, int]]:
    """Return, by frame, its children whose subtrees are static, with the sizes of these."""
    sizes: dict[str, int] = {}
    edges = [edge for siblings in children.values() for edge in siblings]
    order = list(dict.fromkeys(edge.child for edge in edges))
    static = {edge.child: edge.static for edge in edges}
    waiting = order[::-1]
    while waiting:  # not recursive, because a chain may have thousands of frames
        frame = waiting[-1]
        below = [edge.child for edge in children.get(frame, ())]
        missing = [child for child in below if child not in sizes]
        if missing:
            waiting += missing
            continue
        waiting.pop()
        all_static = static[frame] and all(sizes[child] for child in below)
        sizes[frame] = 1 + sum(sizes[child] for child in below) if all_static else 0
    folds = {parent: {edge.child: sizes[edge.child] for edge in siblings if sizes[edge.child]}
             for parent, siblings in children.items()}
    return {parent: fold for parent, fold in folds.items() if sum(fold.values()) >= _WORTH_A_FOLD}


class _Tree(NamedTuple):
    """The tree while it is being listed."""

    children: Children
    wanted: Collection[str]
    folds: Mapping[str, Mapping[str, int]]
    unfolded: Collection[str]

    def below(self, root: str) -> list[FrameRow]:
        """Return the rows below a frame, without recursion, because a chain may be long."""
        result: list[FrameRow] = []
        waiting = self._siblings(root, '')
        while waiting:
            row = waiting.pop()
            more = row.lead.endswith('│  ')
            result.append(row._replace(lead=f'{row.lead[:-3]}{"├─" if more else "└─"} '))
            if row.folds is None:
                waiting += self._siblings(row.frame, row.lead)
        return result

    def _siblings(self, parent: str, lead: str) -> list[FrameRow]:
        """Return the rows directly below a frame, in reverse order."""
        fold = self.folds.get(parent, {})
        folded = parent not in self.unfolded
        rows = [FrameRow(edge.child, lead, edge.static) for edge in self.children.get(parent, ())
                if edge.child in self.wanted and not (folded and edge.child in fold)]
        if fold:
            count = sum(fold.values())
            sign = '▸' if folded else '▾'
            rows.append(FrameRow(parent, lead, None, f'{sign} {count} static on {parent}'))
        return [row._replace(lead=lead + ('│  ' if number else '   '))
                for number, row in enumerate(reversed(rows))]


def biggest_root(edges: Sequence[EdgeInfo]) -> str | None:
    """Return the root with the most frames below it, which is the default fixed frame."""
    hung = {edge.child for edge in edges}
    roots = dict.fromkeys(edge.parent for edge in edges if edge.parent not in hung)
    links = links_of(edges)
    return max(roots, key=lambda root: len(reached(root, links)), default=None)
