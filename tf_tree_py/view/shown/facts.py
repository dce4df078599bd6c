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

"""What is told of a frame that was chosen."""

from collections.abc import Sequence
import math

from tf_tree_py.core import EdgeInfo, Pose
from tf_tree_py.core.stamp import format_span, format_stamp, LATEST
from tf_tree_py.core.telling import words
from tf_tree_py.core.telling.explanation import explain, ExplainedEdge, Explanation
from tf_tree_py.core.tree.queries import Queries

from .living import interval
from .moment import Moment

Fact = tuple[str, str]


def facts(tree: Queries, edges: Sequence[EdgeInfo], moment: Moment, frame: str) -> list[Fact]:
    """
    Return what there is to tell of a frame, as pairs of a name and a value.

    :param edges: of the tree, with who publishes them.
    """
    place = moment.place(frame)
    stamp = moment.stamp if place is None else int(moment.stamps[place])
    told = explain(tree, moment.fixed_frame, frame, stamp, now=moment.stamp)
    own = next((edge for edge in edges if edge.child == frame), None)
    return [*_pose(moment, place, frame), *_edge(own),
            *_age(moment, place), *_way(told)]


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
    told = [('parent', edge.parent), ('publisher', edge.authority or 'unknown')]
    if edge.static:
        return [*told, ('kind', 'static')]
    rate = f'{1e9 / interval(edge):.1f} Hz' if edge.span else 'unknown: one sample'
    return [*told, ('rate', rate),
            ('samples', f'{edge.samples} in {format_span(edge.span)}')]


def _age(moment: Moment, place: int | None) -> list[Fact]:
    if place is None:
        return []
    stamp = int(moment.stamps[place])
    told = [] if stamp == LATEST else [('stamp', f'{format_stamp(stamp)} s')]
    if moment.ages[place]:
        told.append(('age', format_span(int(moment.ages[place]))))
    if moment.stale[place]:
        told.append(('stale', 'shown where it was last'))
    return told


def _way(told: Explanation) -> list[Fact]:
    """Return the path to the fixed frame, and how sure it is; or why there is none."""
    if told.pose is None:
        return [('why', told.problem)]
    way = [(f'{edge.info.parent} → {edge.info.child}', _of_edge(edge, told.stamp))
           for edge in told.edges]
    if told.certainty is None:
        return way
    return [*way, ('sigma', words.sigma(told.certainty)),
            *((f'of it {edge}', part) for edge, part in words.shares(told.certainty))]


def _of_edge(edge: ExplainedEdge, stamp: int) -> str:
    if edge.info.static:
        return _joined(words.kind_of(edge), _sender(edge))
    apart = words.apart(edge)
    return _joined(words.kind_of(edge), _newest(edge.age), words.around(edge, stamp),
                   apart and f'{apart} apart', _sender(edge))


def _newest(age: int | None) -> str:
    if age is None:
        return ''
    return f'newest {format_span(abs(age))} {"after" if age < 0 else "before"} this'


def _sender(edge: ExplainedEdge) -> str:
    return edge.info.authority and f'from {edge.info.authority}'


def _joined(*parts: str) -> str:
    return ', '.join(filter(None, parts))
