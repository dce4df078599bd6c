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

"""Why a lookup is answered as it is, or not at all: data first, with plain data for JSON."""

from dataclasses import dataclass
from itertools import islice
from typing import Any

from .certainty import Certainty, certainty_of
from .diagnosis import EdgeDiagnosis
from .missing import what_is_missing
from ..errors import TransformException
from ..geometry import se3
from ..geometry.pose import Pose
from ..stamp import LATEST
from ..suggest import nearest
from ..tree.outline import EdgeInfo
from ..tree.queries import Queries

# More frames than this are not listed where one is missing.
_MAX_FRAMES = 100


@dataclass(frozen=True)
class ExplainedEdge:
    """
    One edge on the way from one frame to another, at a stamp.

    :ivar info: what is stored of it, and who sent it last.
    :ivar age: from its newest sample to now, nanoseconds; None for a static edge.
    :ivar around: the stamps of the samples that the pose is interpolated between: one where
        the stamp is a sample's own, or outside of what is stored; none for a static edge.
    :ivar gone: how far the frame goes from the first of them to the second, metres.
    :ivar turned: how far it turns, radians.
    :ivar lacks: how far the stamp lies outside of what is stored, nanoseconds: positive
        behind the newest sample, negative before the oldest, 0 within.
    """

    info: EdgeInfo
    age: int | None = None
    around: tuple[int, ...] = ()
    gone: float = 0.0
    turned: float = 0.0
    lacks: int = 0

    @property
    def rate_hz(self) -> float:
        """Return how many samples a second are stored; 0 for a static edge."""
        return EdgeDiagnosis(self.info).rate_hz

    @property
    def gap(self) -> int:
        """Return the time between the two samples, nanoseconds; 0 if there are not two."""
        return self.around[-1] - self.around[0] if self.around else 0


@dataclass(frozen=True)
class Explanation:
    """
    A lookup: its answer, and where that comes from; or what is missing.

    :ivar target: the target frame.
    :ivar source: the source frame.
    :ivar asked: the stamp asked for, nanoseconds; ``LATEST`` is one.
    :ivar stamp: of the answer; ``LATEST`` where nothing between the frames moves. Without an
        answer the one asked for.
    :ivar now: when it was asked, by the clock of the stamps; 0: that is not known.
    :ivar pose: ``target_T_source``; None: there is no answer.
    :ivar problem: why there is none, one sentence.
    :ivar frames: the frames from the source to the target; empty where nothing joins them.
    :ivar edges: from the source up to where the two meet, and down to the target.
    :ivar unknown: of the two frames those that nobody published, with the name that may be
        meant, or None.
    :ivar known: the frames that there are, where one of the two is not among them.
    :ivar certainty: how far the answer may be off; None where no edge on the way has a
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
        """Return from the stamp of the answer to now; None: static, or not known."""
        known = self.pose is not None and self.stamp != LATEST and self.now
        return self.now - self.stamp if known else None

    @property
    def slowest(self) -> ExplainedEdge | None:
        """Return the edge whose newest sample is the oldest: it holds the latest back."""
        moving = [edge for edge in self.edges if not edge.info.static]
        return min(moving, key=lambda edge: edge.info.latest, default=None)

    def as_dict(self) -> dict[str, Any]:
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


def _plain(edge: ExplainedEdge) -> dict[str, Any]:
    return {**edge.info._asdict(), 'rate_hz': edge.rate_hz, 'age': edge.age,
            'around': list(edge.around), 'gap': edge.gap, 'gone_m': edge.gone,
            'turned_rad': edge.turned, 'lacks': edge.lacks}


def explain(tree: Queries, target: str, source: str, stamp: int = LATEST,
            now: int = 0) -> Explanation:
    """
    Ask a tree, and return the answer with all that it comes from.

    Data may arrive meanwhile: ask a snapshot to be sure that all parts agree.

    :param stamp: nanoseconds, or ``LATEST``.
    :param now: the time by the clock of the stamps, nanoseconds; 0: not known.
    """
    try:
        found, answer = tree.lookup_stamped(target, source, stamp)
        pose, problem = Pose._make(answer), ''
    except TransformException as error:
        found, pose, problem = stamp, None, what_is_missing(tree, error)
    names = tuple(tree.frames())
    unknown = tuple((frame, nearest(frame, names)) for frame in dict.fromkeys((target, source))
                    if frame not in names)
    frames, edges = _way(tree, target, source, found if pose else LATEST)
    return Explanation(
        target, source, stamp, found, now, pose, problem, frames,
        tuple(_explained(tree, edge, found, now) for edge in edges),
        unknown, tuple(islice(names, _MAX_FRAMES)) if unknown else (),
        certainty_of(tree, target, source, found) if pose else None)


def _way(tree: Queries, target: str, source: str,
         stamp: int) -> tuple[tuple[str, ...], list[EdgeInfo]]:
    """Return the frames and the edges between two frames; nothing where nothing joins them."""
    try:
        return (tuple(tree.frames_between(target, source, stamp)),
                tree.edges_between(target, source, stamp))
    except TransformException:
        return (), []


def _explained(tree: Queries, info: EdgeInfo, stamp: int, now: int) -> ExplainedEdge:
    if info.static:
        return ExplainedEdge(info)
    age = now - info.latest if now else None
    if stamp == LATEST:
        return ExplainedEdge(info, age, (info.latest,))
    around = tree.samples_around(info.child, stamp)
    gone, turned = se3.distance(around[0][1], around[-1][1]) if around else (0.0, 0.0)
    lacks = max(0, stamp - info.latest) or min(0, stamp - info.oldest)
    return ExplainedEdge(info, age, tuple(knot for knot, _ in around), gone, turned, lacks)
