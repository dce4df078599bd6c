"""What is told of a frame that was chosen."""

from collections.abc import Sequence
import math

from tf_tree_py.core import EdgeInfo, Pose, TransformException
from tf_tree_py.core.stamp import format_span, format_stamp, LATEST
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
    own = next((edge for edge in edges if edge.child == frame), None)
    return [*_pose(moment, place, frame), *_edge(own),
            *_age(moment, place), *_way(tree, edges, moment, place, frame)]


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


def _way(tree: Queries, edges: Sequence[EdgeInfo], moment: Moment, place: int | None,
         frame: str) -> list[Fact]:
    """Return the path to the fixed frame, an edge a line; or why there is none."""
    stamp = moment.stamp if place is None else int(moment.stamps[place])
    try:
        way = Queries.edges_between(tree, moment.fixed_frame, frame, stamp)
    except TransformException as error:
        return [('why', str(error))]
    latest = {edge.child: edge for edge in edges}
    return [(f'{edge.parent} → {edge.child}', _of_edge(latest.get(edge.child, edge), moment))
            for edge in way]


def _of_edge(edge: EdgeInfo, moment: Moment) -> str:
    if edge.static:
        return 'static'
    rate = f'{1e9 / interval(edge):.1f} Hz' if edge.span else 'one sample'
    ahead = edge.latest - moment.stamp
    return f'{rate}, newest {format_span(abs(ahead))} {"after" if ahead > 0 else "before"} this'
