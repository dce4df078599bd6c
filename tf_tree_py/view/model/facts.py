# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The facts that a page shows about the chosen frame."""

from collections.abc import Sequence
import math

from tf_tree_py.buffer_core import AllQueries
from tf_tree_py.core import EdgeInfo, Pose
from tf_tree_py.core.stamp import format_span, format_stamp, LATEST
from tf_tree_py.reports import explanation_text
from tf_tree_py.reports.explanation import explain, ExplainedEdge, Explanation

from .moment import Moment

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
    return [*_pose(moment, place, frame), *_edge(own),
            *_age(moment, place), *_path(explanation)]


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
    return [*found, ('rate', rate),
            ('samples', f'{edge.samples} in {format_span(edge.span)}')]


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
        return _joined(explanation_text.kind_of(edge), _sender(edge))
    apart = explanation_text.apart(edge)
    return _joined(explanation_text.kind_of(edge), _newest(edge.age),
                   explanation_text.around(edge, stamp), apart and f'{apart} apart', _sender(edge))


def _newest(age: int | None) -> str:
    if age is None:
        return ''
    return f'newest {format_span(abs(age))} {"after" if age < 0 else "before"} this'


def _sender(edge: ExplainedEdge) -> str:
    return edge.info.authority and f'from {edge.info.authority}'


def _joined(*parts: str) -> str:
    return ', '.join(filter(None, parts))
