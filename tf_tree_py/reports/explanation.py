# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The explanation of a lookup's answer, or of its failure, as data and as JSON.

It includes the uncertainty of the answer with the contribution of each edge, and, if there is
no answer, the reason in words for the operator of a robot.
"""

from dataclasses import dataclass
from itertools import islice
from math import degrees

from tf_tree_py.beyond.freshness.queries import FreshQueries
from tf_tree_py.beyond.uncertainty.covariances import largest_deviation
from tf_tree_py.beyond.uncertainty.noise import EdgeNoise
from tf_tree_py.beyond.uncertainty.queries import UncertainQueries
from tf_tree_py.beyond.uncertainty.uncertain import Share
from tf_tree_py.core.errors import ExtrapolationException, TransformException
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_span, from_seconds, LATEST
from tf_tree_py.core.text import nearest
from tf_tree_py.core.tree.edge_info import EdgeInfo
from tf_tree_py.core.tree.queries import Queries

# Data this far behind is not late: its stamps come from another clock.
_ANOTHER_CLOCK = from_seconds(3600.0)


def what_is_missing(tree: Queries, error: TransformException) -> str:
    """
    Return why a lookup failed; for a stamp, all edges that ended before it.

    The error itself names one of them.
    """
    if not isinstance(error, ExtrapolationException) or error.requested is None:
        return str(error)
    asked = error.requested
    late = [edge for edge in _moving_edges(tree, error) if edge.latest < asked]
    if late:
        edges = ', '.join(f'{edge.parent} -> {edge.child}' for edge in late)
        senders = ', '.join(sorted({edge.authority for edge in late if edge.authority}))
        gap = asked - min(edge.latest for edge in late)
        by = f', sent by {senders}' if senders else ''
        fact = f'{edges}{by}, ended {format_span(gap)} before'
    elif error.oldest is not None and error.oldest > asked:
        gap = error.oldest - asked
        fact = f'{error.parent} -> {error.child} begins {format_span(gap)} after'
    else:  # the data has arrived since
        return str(error)
    hint = '; do both use the same clock (use_sim_time)?' if gap > _ANOTHER_CLOCK else ''
    return f'{fact} the requested stamp{hint}'


def _moving_edges(tree: Queries, error: TransformException) -> list[EdgeInfo]:
    """Return the moving edges between the two frames, beginning at the target."""
    if error.source_frame is None or error.target_frame is None:
        return []
    try:
        edges = tree.edges_between(error.source_frame, error.target_frame)
    except TransformException:  # they are no longer connected
        return []
    return [edge for edge in edges if not edge.static]


# --- certainty

@dataclass(frozen=True)
class Certainty:
    """
    The uncertainty of ``target_T_source``.

    :ivar covariance: (6, 6), see ``lookup_uncertain``.
    :ivar shares: the contribution of each edge that has a covariance, the largest part of the
        position first.
    """

    covariance: Array
    shares: tuple[Share, ...]

    @property
    def position_sigma(self) -> float:
        """Return the standard deviation of the position in its worst direction, metres."""
        return largest_deviation(self.covariance[:3, :3])

    @property
    def rotation_sigma(self) -> float:
        """Return the standard deviation of the rotation about its worst axis, radians."""
        return largest_deviation(self.covariance[3:, 3:])

    def as_dict(self) -> dict[str, object]:
        """Return it as plain data."""
        return {'sigma_m': self.position_sigma, 'sigma_deg': degrees(self.rotation_sigma),
                'covariance': self.covariance.tolist(),
                'shares': [{'parent': share.parent, 'child': share.child,
                            'position': share.position, 'rotation': share.rotation}
                           for share in self.shares]}


def _certainty_of(tree: UncertainQueries, target: str, source: str,
                  stamp: int) -> Certainty | None:
    """
    Return the uncertainty of a lookup's answer.

    :param stamp: of the answer, nanoseconds.
    :return: None if no edge between the two has a covariance.
    """
    if not tree.has_covariances:
        return None
    try:
        shares = tree.lookup_budget(target, source, stamp)
        # A buffer of ROS returns a message.
        covariance = (UncertainQueries.lookup_uncertain(tree, target, source, stamp)[1]
                      if shares else None)
    except TransformException:  # the data has expired since the lookup
        return None
    return None if covariance is None else Certainty(covariance, tuple(shares))


# --- the explanation

# If a frame is missing, no more than this number of known frames are listed.
_MAX_FRAMES = 100


@dataclass(frozen=True)
class ExplainedEdge:
    """
    One edge on the way from one frame to another, at a stamp.

    :ivar info: its stored samples and its last sender.
    :ivar age: from its newest sample to now, nanoseconds; None for a static edge.
    :ivar around: the stamps of the samples that the pose is interpolated between: one if
        the stamp is that of a sample, or outside the stored span; none for a static edge.
    :ivar gone: the distance of the frame between the first and the second, metres.
    :ivar turned: the angle between them, radians.
    :ivar lacks: how far the stamp lies outside the stored span, nanoseconds: positive
        after the newest sample, negative before the oldest, 0 within.
    :ivar noise: of its samples; None if it is static, or unknown, or was not asked for.
    """

    info: EdgeInfo
    age: int | None = None
    around: tuple[int, ...] = ()
    gone: float = 0.0
    turned: float = 0.0
    lacks: int = 0
    noise: EdgeNoise | None = None

    @property
    def rate_hz(self) -> float:
        """Return the number of stored samples per second; 0 for a static edge."""
        return self.info.rate_hz

    @property
    def gap(self) -> int:
        """Return the time between the two samples, nanoseconds; 0 if there are not two."""
        return self.around[-1] - self.around[0] if self.around else 0


@dataclass(frozen=True)
class Explanation:
    """
    A lookup: its answer and the data that it is computed from, or what is missing.

    :ivar target: the target frame.
    :ivar source: the source frame.
    :ivar asked: the requested stamp, nanoseconds, or ``LATEST``.
    :ivar stamp: the stamp of the answer; ``LATEST`` if all edges between the frames are static.
        Without an answer, the requested stamp.
    :ivar now: the time of the lookup, by the clock of the stamps; 0: unknown.
    :ivar pose: ``target_T_source``; None if there is no answer.
    :ivar problem: why there is no answer, in one sentence.
    :ivar frames: the frames from the source to the target; empty if they are not connected.
    :ivar edges: from the source up to the common ancestor, and down to the target.
    :ivar unknown: those of the two frames that were never published, each with the name that
        was probably meant, or None.
    :ivar known: the known frames, if one of the two is unknown.
    :ivar certainty: the uncertainty of the answer; None if no edge on the path has a
        covariance.
    """

    target: str
    source: str
    asked: int
    stamp: int
    now: int
    pose: Pose | None = None
    problem: str = ''
    frames: tuple[str, ...] = ()
    edges: tuple[ExplainedEdge, ...] = ()
    unknown: tuple[tuple[str, str | None], ...] = ()
    known: tuple[str, ...] = ()
    certainty: Certainty | None = None

    @property
    def age(self) -> int | None:
        """Return the time from the stamp of the answer to now; None: static, or unknown."""
        known = self.pose is not None and self.stamp != LATEST and self.now
        return self.now - self.stamp if known else None

    @property
    def slowest(self) -> ExplainedEdge | None:
        """Return the edge whose newest sample is the oldest: it limits the latest stamp."""
        moving = [edge for edge in self.edges if not edge.info.static]
        return min(moving, key=lambda edge: edge.info.latest, default=None)

    def as_dict(self) -> dict[str, object]:
        """Return it as plain data, always with the same keys; stamps are nanoseconds."""
        return {
            'target': self.target, 'source': self.source, 'asked': self.asked,
            'stamp': self.stamp, 'now': self.now, 'age': self.age,
            'translation': None if self.pose is None else list(self.pose.translation),
            'quaternion': None if self.pose is None else list(self.pose.rotation),
            'problem': self.problem, 'frames': list(self.frames),
            'edges': [_plain(edge) for edge in self.edges],
            'unknown': dict(self.unknown), 'known': list(self.known),
            'uncertainty': None if self.certainty is None else self.certainty.as_dict(),
        }


def _plain(edge: ExplainedEdge) -> dict[str, object]:
    return {**edge.info._asdict(), 'rate_hz': edge.rate_hz, 'age': edge.age,
            'around': list(edge.around), 'gap': edge.gap, 'gone_m': edge.gone,
            'turned_rad': edge.turned, 'lacks': edge.lacks,
            'noise': None if edge.noise is None else edge.noise.as_dict()}


def explain(tree: FreshQueries, target: str, source: str, stamp: int = LATEST,
            now: int = 0, max_age: int | None = None, noise: bool = False) -> Explanation:
    """
    Look a transform up, and return the answer with the data that it is computed from.

    Data may arrive meanwhile: pass a snapshot if all parts must be consistent.

    :param stamp: nanoseconds, or ``LATEST``.
    :param now: the time by the clock of the stamps, nanoseconds; 0: unknown.
    :param max_age: how old the latest may be; see ``lookup``.
    :param noise: whether the noise of each edge's samples is learnt, some 10 ms for each edge.
    """
    try:
        found, answer = tree.lookup_no_older(target, source, stamp, max_age)
        pose, problem = Pose._make(answer), ''
    except TransformException as error:
        found, pose, problem = stamp, None, what_is_missing(tree, error)
    names = tuple(tree.frames())
    unknown = tuple((frame, nearest(frame, names)) for frame in dict.fromkeys((target, source))
                    if frame not in names)
    frames, edges = _way(tree, target, source, found if pose else LATEST)
    return Explanation(
        target, source, stamp, found, now, pose, problem, frames,
        tuple(_explained(tree, edge, found, now, noise) for edge in edges),
        unknown, tuple(islice(names, _MAX_FRAMES)) if unknown else (),
        _certainty_of(tree, target, source, found) if pose else None)


def _way(tree: UncertainQueries, target: str, source: str,
         stamp: int) -> tuple[tuple[str, ...], list[EdgeInfo]]:
    """Return the frames and the edges between two frames; none if they are not connected."""
    try:
        return (tuple(tree.frames_between(target, source, stamp)),
                tree.edges_between(target, source, stamp))
    except TransformException:
        return (), []


def known_noise(tree: UncertainQueries, info: EdgeInfo) -> EdgeNoise | None:
    """Return the noise of an edge's samples; None if it is unknown."""
    try:
        return None if info.static else tree.edge_noise(info.child)
    except TransformException:
        return None


def _explained(tree: UncertainQueries, info: EdgeInfo, stamp: int, now: int,
               with_noise: bool) -> ExplainedEdge:
    if info.static:
        return ExplainedEdge(info)
    age = now - info.latest if now else None
    noise = known_noise(tree, info) if with_noise else None
    if stamp == LATEST:
        return ExplainedEdge(info, age, (info.latest,), noise=noise)
    around = tree.samples_around(info.child, stamp)
    gone, turned = se3.distance(around[0][1], around[-1][1]) if around else (0.0, 0.0)
    lacks = max(0, stamp - info.latest) or min(0, stamp - info.oldest)
    return ExplainedEdge(info, age, tuple(knot for knot, _ in around), gone, turned, lacks,
                         noise)
