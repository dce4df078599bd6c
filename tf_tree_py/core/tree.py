"""
Which frames hang on which: the edges, the way between two frames, the one rule.

The rule: at any time a frame has one parent, and no edge closes a loop. An edge
that would is refused here, when it arrives, so no lookup ever meets one.
Samples over time are ``history``'s, arithmetic is ``path``'s, the lock is
``buffer_core``'s.
"""

from collections.abc import Container, Sequence
from functools import partial

from . import se3
from .errors import (
    ANY_STRUCTURE,
    ConnectivityException,
    ExtrapolationException,
    Hint,
    InvalidArgumentException,
    LookupException,
)
from .history import DynamicHistory, History, pack_pose, StaticHistory
from .incidents import Incident, is_ambiguous, Kind
from .path import Path
from .sample import Batch, is_sound, Sample
from .se3 import PoseTuple
from .stamp import format_span, format_stamp, LATEST
from .suggest import known_names

Edge = tuple[str, str]
# An edge, the end that is reached, the end to reach, and whether that is the parent.
Step = tuple[History, str, str, bool]

# Kinds of message whose edges are remembered; who sends ever new ones gains nothing.
_MAX_KNOWN = 256


class Tree:
    """
    All edges of a buffer, by child frame.

    The parent belongs to the sample, so the tree may change over time. A path on
    which no edge ever changed its parent is kept until the structure changes;
    ``version`` counts those changes.

    :ivar histories: each child frame's samples.
    :ivar frames: every frame name, in order of first appearance.
    :ivar when_empty: the hint for who asks before there is any.
    """

    def __init__(self, cache_time: int, max_frames: int) -> None:
        self.cache_time = cache_time
        self.max_frames = max_frames
        self.when_empty = 'Nothing has been received yet'
        self.histories: dict[str, History] = {}
        self.frames: dict[str, None] = {}
        self.version = 0
        self._paths: dict[Edge, Path] = {}
        self._known: dict[int, tuple[Sequence[Edge], list[History | None]]] = {}
        self._steps: dict[str, list[Step]] = {}
        self._fights: set[Edge] = set()

    # --- inserting

    def append(self, sample: Sample, authority: str) -> bool:
        """
        Take the next sample of an edge that did not change: the common case.

        :return: False, with nothing done, when it needs a closer look.
        """
        parent, child, stamp, pose = sample
        history = self.histories.get(child)
        if (history is None or history.parent != parent or not is_sound(pose)
                or not history.append(stamp, pack_pose(*pose))):
            return False
        history.authority = authority
        return True

    def append_batch(self, batch: Batch, authority: str) -> int:
        """
        Take the next samples of edges that did not change: ``append`` for a message.

        :param batch: with sound poses.
        :return: how many it took, up to the first that needs a closer look.
        """
        histories = self._known_edges(batch.edges)
        taken = 0
        for history, stamp, pose in zip(histories, batch.stamps, batch.poses, strict=True):
            if history is None or not history.append(stamp, pose):
                break
            history.authority = authority
            taken += 1
        return taken

    def _known_edges(self, edges: Sequence[Edge]) -> list[History | None]:
        """Return the history of each edge that is in the tree just so; kept for the next time."""
        # The edges stand beside their histories, so that no other object gets their id.
        kept = self._known.get(id(edges))
        if kept is not None:
            return kept[1]
        if len(self._known) >= _MAX_KNOWN:
            self._known.clear()
        known = []
        for parent, child in edges:
            history = self.histories.get(child)
            known.append(history if history and history.parent == parent else None)
        self._known[id(edges)] = (edges, known)
        return known

    def insert(self, parent: str, child: str, stamp: int, pose: PoseTuple,
               authority: str, static: bool) -> list[Incident]:
        """
        Take one checked sample (see ``sample``), unless it breaks a rule.

        :return: what was refused or is worth telling; empty nearly always.
        """
        history = self.histories.get(child)
        if isinstance(history, DynamicHistory) and not static and (
                history.parent == parent and history.fixed_parent or history.is_too_old(stamp)):
            if history.insert(stamp, parent, pose):
                history.authority = authority
                return []
            return [self._too_old(history, parent, stamp, authority)]
        return self._insert_new_edge(history, parent, child, stamp, pose, authority, static)

    def _insert_new_edge(self, history: History | None, parent: str, child: str, stamp: int,
                         pose: PoseTuple, authority: str, static: bool) -> list[Incident]:
        """Take a sample that may change the structure."""
        unknown = {parent, child} - self.frames.keys()
        if len(self.frames) + len(unknown) > self.max_frames:
            return [Incident(
                Kind.TOO_MANY_FRAMES, parent, child, stamp, authority,
                f'the buffer already knows {len(self.frames)} frames, its limit (max_frames)')]
        newest = (static or not isinstance(history, DynamicHistory)
                  or history.latest_stamp is None or stamp >= history.latest_stamp)
        # A late sample must not close a loop then; the newest, neither then nor now.
        times = (stamp, LATEST) if newest else (stamp,)
        incidents = self._drop_stale_loop(parent, child, times, authority, static)
        loop = self._loop(parent, child, times)
        if loop:
            return [*incidents, self._loop_closed(loop, child, stamp, authority)]
        incidents += self._remarks(history, parent, child, stamp, authority, static)
        if static:
            self.histories[child] = StaticHistory(child, parent, pose, authority)
        else:
            if not isinstance(history, DynamicHistory):
                history = DynamicHistory(child, self.cache_time)
            unchanged = (not history.fixed_parent and history.parent == parent
                         and history.latest_stamp is not None and stamp >= history.latest_stamp)
            history.insert(stamp, parent, pose)
            history.authority = authority
            # Not before: a stamp of more than 64 bits does not get here.
            self.histories[child] = history
            if unchanged:
                return incidents
        self.frames.setdefault(child)
        self.frames.setdefault(parent)
        self._structure_changed()
        return incidents

    def _structure_changed(self) -> None:
        self.version += 1
        self._paths.clear()
        self._known.clear()
        self._steps.clear()

    def _loop(self, parent: str, child: str, times: Sequence[int]) -> list[History]:
        """Return the edges from a parent up to its would-be child; none if it is not up there."""
        if child not in self.frames:
            return []  # nothing hangs on a new name: the climb would be in vain
        for stamp in times:
            edges: list[History] = []
            frame: str | None = parent
            while frame in self.histories and len(edges) <= len(self.histories):
                history = self.histories[frame]
                edges.append(history)
                frame = history.nearest_parent(stamp)
                if frame == child:
                    return edges
        return []

    def _drop_stale_loop(self, parent: str, child: str, times: Sequence[int], authority: str,
                         static: bool) -> list[Incident]:
        """Forget an edge in the way that nobody has published for longer than the window."""
        if static:
            return []
        stamp = times[0]
        for edge in self._loop(parent, child, times):
            if isinstance(edge, DynamicHistory) and edge.latest_stamp is not None:
                age = stamp - edge.latest_stamp
                if age > self.cache_time:
                    incident = Incident(
                        Kind.STALE_EDGE_DROPPED, parent, child, stamp, authority,
                        f'it turns round the edge {edge.parent!r} -> {edge.child!r} from '
                        f'{edge.authority!r}, whose newest sample is {format_span(age)} older; '
                        'that edge was dropped')
                    edge.clear()
                    return [incident]
        return []

    def _loop_closed(self, loop: list[History], child: str, stamp: int,
                     authority: str) -> Incident:
        frames = [*(edge.child for edge in loop), child]
        way = ' -> '.join([child, *frames])
        kept = ', '.join(f'{above!r} -> {edge.child!r} from {edge.authority!r}'
                         for edge, above in zip(loop, frames[1:], strict=True))
        return Incident(
            Kind.LOOP, frames[0], child, stamp, authority,
            f'each frame the child of the next, {way} is a loop; kept: {kept}. '
            'Two nodes disagree about who is whose parent: stop the sender of this, or the other')

    def _too_old(self, history: DynamicHistory, parent: str, stamp: int,
                 authority: str) -> Incident:
        assert history.latest_stamp is not None
        return Incident(
            Kind.OLD_DATA, parent, history.child, stamp, authority,
            f'its stamp {format_stamp(stamp)} is {format_span(history.latest_stamp - stamp)} '
            f'older than the newest, {format_stamp(history.latest_stamp)}, and the buffer keeps '
            f'{format_span(self.cache_time)}; the last one heard was {history.authority!r}',
            history.latest_stamp)

    def _remarks(self, history: History | None, parent: str, child: str, stamp: int,
                 authority: str, static: bool) -> list[Incident]:
        """Return what to tell about a sample that is taken; the same fight only once."""
        if history is None or history.parent is None:
            return []
        remarks = []
        if history.is_static != static:
            before, now = ('dynamic', 'static') if static else ('static', 'dynamic')
            remarks.append(Incident(
                Kind.KIND_CHANGE, parent, child, stamp, authority,
                f'it was {before} from {history.authority!r} and is now {now}; '
                'what was stored of it is gone'))
        if history.parent != parent and (child, parent) not in self._fights and (
                history.authority != authority or _goes_back(history, parent, authority)):
            self._fights |= {(child, parent), (child, history.parent)}
            remarks.append(Incident(
                Kind.SECOND_PARENT, parent, child, stamp, authority,
                f'{history.authority!r} says that its parent is {history.parent!r}; '
                'while both go on, every lookup through it depends on who came last'))
        return remarks

    # --- finding the way

    def path(self, target: str, source: str, stamp: int) -> Path:
        """
        Return the way between two frames, for a stamp if it depends on that.

        The textbook's walk: climb from the source, climb from the target, meet at
        the lowest common ancestor.

        :param stamp: nanoseconds; ``LATEST`` goes by every edge's newest sample.
        :raises InvalidArgumentException: a name that cannot be a frame.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        :raises ExtrapolationException: nothing joins them, and an edge has no data then.
        """
        try:
            path = self._paths.get((target, source))
        except TypeError:  # a list, say: the checks below name it
            path = None
        if path is None:
            self.check_frame('target_frame', target)
            self.check_frame('source_frame', source)
            path = self._find_path(target, source, stamp)
            if path.fixed:
                self._paths[target, source] = path
        return path

    def check_frame(self, argument: str, frame: str) -> None:
        """
        Say what is wrong with a frame name in a query, if anything.

        :raises InvalidArgumentException: empty, or with a leading slash.
        :raises LookupException: not known.
        """
        if not isinstance(frame, str) or not frame or frame.startswith('/'):
            raise InvalidArgumentException(
                f'Invalid argument {argument} {frame!r}: a frame in a query is a string, '
                'not empty and without a leading slash')
        if frame not in self.frames:
            raise LookupException(
                f'"{frame}" passed to lookupTransform argument {argument} does not exist',
                hint=self._known_frames(frame), blocked_on=ANY_STRUCTURE)

    def _known_frames(self, frame: str) -> Hint:
        if not self.frames:
            return self.when_empty
        return partial(known_names, frame, tuple(self.frames))

    def _find_path(self, target: str, source: str, stamp: int) -> Path:
        source_edges, target_edges, _ = self._climb_both(target, source, stamp)
        return Path(source_edges, target_edges)

    def frames_between(self, target: str, source: str, stamp: int) -> list[str]:
        """
        Return the frames from the source up to the meeting point and down to the target.

        Parameters and errors are those of ``path``.
        """
        self.check_frame('target_frame', target)
        self.check_frame('source_frame', source)
        return self._climb_both(target, source, stamp)[2]

    def _climb_both(self, target: str, source: str, stamp: int
                    ) -> tuple[list[History], list[History], list[str]]:
        """Return the edges of both branches below their meeting point, and all frames."""
        source_edges, source_frames = self._climb(source, stamp, (target,))
        target_edges, target_frames = self._climb(target, stamp, set(source_frames))
        if target_frames[-1] not in source_frames:
            raise self._not_joined(target_frames, source_frames, stamp)
        meeting = source_frames.index(target_frames[-1])
        frames = [*source_frames[:meeting], *reversed(target_frames)]
        return source_edges[:meeting], target_edges, frames

    def _climb(self, frame: str, stamp: int, stop: Container[str]
               ) -> tuple[list[History], list[str]]:
        """Return the edges from a frame up to one to stop at or to the top, and the frames."""
        edges: list[History] = []
        frames = [frame]
        while frame not in stop:
            history = self.histories.get(frame)
            parent = _parent_of(history, stamp)
            if history is None or parent is None:
                break
            if len(frames) > len(self.frames):
                raise LookupException('The tf tree is invalid because it contains a loop: '
                                      + ' -> '.join(frames[-8:]))
            edges.append(history)
            frames.append(parent)
            frame = parent
        return edges, frames

    def _not_joined(self, target_frames: list[str], source_frames: list[str],
                    stamp: int) -> Exception:
        """Return what tf2 says of two climbs that do not meet."""
        target, source = target_frames[0], source_frames[0]
        if stamp != LATEST:
            for frame in (*source_frames, *target_frames):
                history = self.histories.get(frame)
                try:
                    if history is not None:
                        history.sample(stamp)
                except ExtrapolationException as error:
                    return error
        return ConnectivityException(
            f'Could not find a connection between {target!r} and {source!r} because they are '
            f'not part of the same tree: {target!r} hangs on {target_frames[-1]!r}, '
            f'{source!r} on {source_frames[-1]!r}',
            hint='Tf has two or more unconnected trees: who should publish the edge between them?',
            blocked_on=ANY_STRUCTURE)

    # --- everything at once

    def poses_from(self, target: str, stamp: int) -> dict[str, PoseTuple]:
        """
        Return ``target_T_frame`` for every frame that has one at a stamp.

        :param stamp: nanoseconds; ``LATEST`` is the newest time that all moving edges
            of the target's tree have data for.
        :raises LookupException: nobody published the target.
        :raises InvalidArgumentException: a name that cannot be a frame.
        """
        self.check_frame('target_frame', target)
        if stamp == LATEST:
            stamp = self._latest_of_all(target)
        poses = {target: se3.IDENTITY}
        for history, known, frame, upwards in self._steps_from(target, stamp):
            if known not in poses:
                continue
            try:
                pose = history.sample(stamp)
            except ExtrapolationException:
                continue
            poses[frame] = se3.compose_chain(
                (poses[known], se3.inverse(pose) if upwards else pose))
        return poses

    def _latest_of_all(self, target: str) -> int:
        stamps = [history.latest_stamp for history, *_ in self._steps_from(target, LATEST)
                  if history.latest_stamp]
        return min(stamps, default=LATEST)

    def _steps_from(self, target: str, stamp: int) -> list[Step]:
        """Return the edges in an order in which one end is always reached already."""
        if target in self._steps:
            return self._steps[target]
        neighbours: dict[str, list[Step]] = {}
        for child, history in self.histories.items():
            parent = _parent_of(history, stamp)
            if parent is not None:
                neighbours.setdefault(parent, []).append((history, parent, child, False))
                neighbours.setdefault(child, []).append((history, child, parent, True))
        steps: list[Step] = []
        reached = {target}
        frames = [target]
        for frame in frames:
            for step in neighbours.get(frame, ()):
                if step[2] not in reached:
                    reached.add(step[2])
                    frames.append(step[2])
                    steps.append(step)
        if all(history.fixed_parent for history in self.histories.values()):
            self._steps[target] = steps
        return steps

    def copy(self) -> 'Tree':
        """Return a tree of its own with the same samples."""
        twin = Tree(self.cache_time, self.max_frames)
        twin.histories = {child: history if isinstance(history, StaticHistory) else history.copy()
                          for child, history in self.histories.items()}
        twin.frames = dict(self.frames)
        return twin

    # --- forgetting

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay, as in tf2."""
        for history in self.histories.values():
            if isinstance(history, DynamicHistory):
                history.clear()
        self._structure_changed()

    def remove(self, frame: str) -> bool:
        """
        Forget a frame's edge to its parent, and its name unless something hangs on it.

        :return: whether it was there.
        """
        if frame not in self.frames:
            return False
        self.histories.pop(frame, None)
        if not any(history.parent == frame for history in self.histories.values()):
            del self.frames[frame]
        self._structure_changed()
        return True


def _goes_back(history: History, parent: str, authority: str) -> bool:
    """Return whether a frame returns to a parent and several publishers may be behind it."""
    return (is_ambiguous(authority) and isinstance(history, DynamicHistory)
            and history.has_named(parent))


def _parent_of(history: History | None, stamp: int) -> str | None:
    """Return the parent to climb to; None at the top, and where the data ends."""
    if history is None or history.fixed_parent:
        return history.parent if history else None
    try:
        return history.parent_at(stamp)
    except ExtrapolationException:
        return None
