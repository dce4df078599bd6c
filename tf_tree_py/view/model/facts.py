# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The facts that a page shows about the chosen frame.

Also its motion in another frame, as measured values and as data for plots.
"""

from collections.abc import Sequence
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
