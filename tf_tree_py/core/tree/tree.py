"""
Which frames hang on which: the edges, the way between two frames, the one rule.

The rule: at any time a frame has one parent, and no edge closes a loop. An edge that
would close one is refused when it arrives, so no lookup ever meets a loop. The samples
are kept by ``edges``, poses are composed by ``path``, and the lock is the buffer's.
"""

from collections.abc import Sequence
from functools import partial

from .climb import blockers, Branches, climb_both, find_loop, Loop
from .path import furthest_from_cure, Path
from ..arrivals.incidents import Incident, is_ambiguous, Kind
from ..arrivals.sample import bad_name, Batch, is_sound, Sample
from ..edges.discrete import DynamicHistory
from ..edges.packed import pack_pose
from ..edges.protocol import History, moves, MovingHistory
from ..edges.static import StaticHistory
from ..errors import (
    ANY_STRUCTURE,
    Blocker,
    ConnectivityException,
    ExtrapolationException,
    Hint,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from ..geometry import se3
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..stamp import BEGINNING, FOREVER, format_span, format_stamp, LATEST
from ..suggest import known_names
from ..times import Stamps

Edge = tuple[str, str]
# An edge, the end that is reached, the end to reach, and whether that is the parent.
Step = tuple[History, str, str, bool]

# Kinds of message whose edges are remembered, and edges of all of them together. The limits hold
# even if a hostile publisher sends new ones all the time.
_MAX_KNOWN = 256
_MAX_KNOWN_EDGES = 20_000
# Paths kept to save time, and fights that were reported: all are forgotten at these numbers.
_MAX_PATHS = 20_000
_MAX_FIGHTS = 1_000


class Tree:
    """
    All edges of a buffer, by child frame.

    The parent belongs to the sample, so the tree may change over time. A path on
    which no edge ever changed its parent is kept until the structure changes;
    ``version`` counts those changes. A sample that is older than all others of its edge
    is such a change, too.

    :ivar histories: each child frame's samples.
    :ivar frames: every frame name, in order of first appearance.
    :ivar when_empty: the hint of an error while there is no frame.
    """

    def __init__(self, cache_time: int, max_frames: int, max_name_bytes: int) -> None:
        self.cache_time = cache_time
        self.max_frames = max_frames
        self.max_name_bytes = max_name_bytes
        self.when_empty = 'Nothing has been received yet'
        self.histories: dict[str, History] = {}
        self.frames: dict[str, None] = {}
        self.version = 0
        self._was_rehung: bool | None = None
        self._paths: dict[Edge, Path] = {}
        self._known: dict[int, tuple[Sequence[Edge], list[History | None]]] = {}
        self._known_count = 0
        self._steps: dict[str, list[Step]] = {}
        self._fights: set[Edge] = set()

    # --- inserting

    def append(self, sample: Sample, authority: str) -> bool:
        """
        Take a sample that continues a known edge: the common case.

        :return: False, with nothing done, in all other cases: see ``insert``.
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
        Take the samples of a message that continue known edges: ``append`` for each.

        :param batch: with checked poses.
        :return: how many it took: all before the first that does not continue its edge.
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
        """Return each edge's history if its parent is the same; remembered for the next time."""
        # The edges are kept beside their histories: while they live, no other object has their id.
        kept = self._known.get(id(edges))
        if kept is not None:
            return kept[1]
        known = []
        for parent, child in edges:
            history = self.histories.get(child)
            known.append(history if history and history.parent == parent else None)
        # An unknown edge may be refused for ever, and its names may be of any length: not kept.
        if None not in known:
            if (len(self._known) >= _MAX_KNOWN
                    or self._known_count + len(known) > _MAX_KNOWN_EDGES):
                self._known.clear()
                self._known_count = 0
            self._known[id(edges)] = (edges, known)
            self._known_count += len(known)
        return known

    def insert(self, parent: str, child: str, stamp: int, pose: PoseTuple,
               authority: str, static: bool) -> list[Incident]:
        """
        Take one checked sample (see ``sample``), unless it breaks a rule.

        :return: what was refused or is odd; nearly always empty.
        """
        history = self.histories.get(child)
        if history is not None and history.is_static == static and (
                history.goes_on(parent, stamp, pose) or history.is_too_old(stamp)):
            if history.insert(stamp, parent, pose):
                history.authority = authority
                return []
            return [self._too_old(history, parent, stamp, authority)]
        return self._insert_new_edge(history, parent, child, stamp, pose, authority, static)

    def history_to_extend(self, parent: str, child: str, stamp: int) -> MovingHistory | None:
        """
        Return the history of an edge if samples from a stamp on can simply be added.

        None if one of them might change the structure, or be refused because of it.
        """
        history = self.histories.get(child)
        if not moves(history) or not history.fixed_parent or history.parent != parent:
            return None
        began = history.oldest_stamp
        if began is None:
            return None
        if began <= stamp or find_loop(
                self.histories, parent, child, stamp, FOREVER, []) is None:
            return history
        return None

    def extend(self, history: MovingHistory, stamps: Stamps, poses: Array,
               authority: str) -> None:
        """Take samples of an edge; see ``history_to_extend`` and ``MovingHistory.extend``."""
        began = history.oldest_stamp
        history.extend(stamps, poses)
        history.authority = authority
        if began is not None and stamps.min() < began:
            self._structure_changed()

    def _insert_new_edge(self, history: History | None, parent: str, child: str, stamp: int,
                         pose: PoseTuple, authority: str, static: bool) -> list[Incident]:
        """Take a sample that may change the structure."""
        unknown = {parent, child} - self.frames.keys()
        bad = bad_name(parent, child, stamp, authority, self.max_name_bytes) if unknown else None
        if bad:
            return [bad]
        if len(self.frames) + len(unknown) > self.max_frames:
            return [Incident(
                Kind.TOO_MANY_FRAMES, parent, child, stamp, authority,
                f'the buffer already knows {len(self.frames)} frames, its limit (max_frames)')]
        silent: list[MovingHistory] = []
        if child in self.frames:  # else nothing hangs on it
            loop = self._close_loop(parent, child, _time_of(history, stamp, static), silent)
            if loop is not None:
                return [self._loop_closed(loop, child, stamp, authority)]
        incidents = [self._ended(edge, parent, child, stamp, authority) for edge in silent]
        incidents += self._remarks(history, parent, child, stamp, authority, static)
        if static:
            self.histories[child] = StaticHistory(child, parent, pose, authority)
        else:
            if history is None or history.is_static:
                history = DynamicHistory(child, self.cache_time)
            unchanged = (not history.fixed_parent and history.parent == parent
                         and history.latest_stamp is not None and stamp >= history.latest_stamp)
            history.insert(stamp, parent, pose)
            history.authority = authority
            self.histories[child] = history
            if unchanged and not silent:
                return incidents
        self.frames.setdefault(child)
        self.frames.setdefault(parent)
        self._structure_changed()
        return incidents

    def _structure_changed(self) -> None:
        self.version += 1
        self._was_rehung = None
        self._paths.clear()
        self._known.clear()
        self._known_count = 0
        self._steps.clear()

    def _close_loop(self, parent: str, child: str, time: tuple[int, int],
                    silent: list[MovingHistory]) -> Loop | None:
        """
        Return the loop that a new edge would close at some time, if any.

        If nothing newer is known of the child, an edge of the loop that fell silent may
        give way to the new one.

        :param time: when the parent would be the parent: from the first stamp up to, but
            without, the second.
        :param silent: the edges that give way are added here.
        """
        begin, end = time
        while True:
            loop = find_loop(self.histories, parent, child, begin, end, silent)
            if loop is None or end != FOREVER:
                return loop
            gives_way = [edge for edge in loop.edges
                         if moves(edge) and edge.fell_silent(begin)]
            if not gives_way:
                return loop
            silent += gives_way[:1]

    def _ended(self, edge: MovingHistory, parent: str, child: str, stamp: int,
               authority: str) -> Incident:
        """End a silent edge because a new edge turns it round; return the incident."""
        assert edge.latest_stamp is not None
        incident = Incident(
            Kind.SILENT_EDGE_ENDED, parent, child, stamp, authority,
            f'it turns round the edge {edge.parent!r} -> {edge.child!r} from '
            f'{edge.authority!r}, whose newest sample is '
            f'{format_span(stamp - edge.latest_stamp)} older; that edge ended with it, and its '
            'past can still be asked for')
        edge.end()
        return incident

    def _loop_closed(self, loop: Loop, child: str, stamp: int, authority: str) -> Incident:
        parent = loop.edges[0].child
        way = ' -> '.join([child, parent, *loop.frames])
        kept = ', '.join(f'{above!r} -> {edge.child!r} from {edge.authority!r}'
                         for edge, above in zip(*loop, strict=True))
        return Incident(
            Kind.LOOP, parent, child, stamp, authority,
            f'each frame the child of the next, {way} is a loop; kept: {kept}. '
            'Two nodes disagree about who is whose parent: stop the sender of this, or the other')

    def _too_old(self, history: History, parent: str, stamp: int,
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
        """Return remarks on a sample that is taken; each fight over a parent only once."""
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
            if len(self._fights) > _MAX_FIGHTS:
                self._fights.clear()
            self._fights |= {(child, parent), (child, history.parent)}
            remarks.append(Incident(
                Kind.SECOND_PARENT, parent, child, stamp, authority,
                f'{history.authority!r} says that its parent is {history.parent!r}; '
                'while both go on, every lookup through it depends on who came last'))
        return remarks

    # --- finding the way

    def newest_path(self, target: str, source: str) -> Path:
        """
        Return the way between two frames by every edge's newest sample.

        The textbook's walk: climb from the source, climb from the target, meet at
        the lowest common ancestor.

        :raises InvalidArgumentException: a name that cannot be a frame.
        :raises LookupException: a frame that nobody published.
        :raises ConnectivityException: nothing joins the two.
        """
        return self._kept_path(target, source) or self._find_path(target, source, None)

    def pose_at(self, target: str, source: str, stamp: int) -> PoseTuple:
        """
        Return ``target_T_source`` at a stamp, by the way that there was then.

        :param stamp: nanoseconds; 0 is a time here.
        :raises ExtrapolationException: nothing joins them, and an edge has no data then.

        The other errors are those of ``newest_path``.
        """
        path = self._kept_path(target, source)
        if path is not None:
            try:
                return path.pose_at(stamp)
            except ExtrapolationException:
                if not self.was_rehung:
                    raise path.failure(stamp) from None
                # A frame hung elsewhere at some time, so there may be another way.
        return self._find_path(target, source, stamp).pose_at(stamp)

    def newest_pose(self, target: str, source: str) -> tuple[int, PoseTuple]:
        """
        Return the newest time that every edge between two frames has data for, and the pose.

        Errors are those of ``newest_path`` and ``pose_at``.
        """
        path = self.newest_path(target, source)
        stamp = path.latest_common_time()
        try:
            return stamp, self.pose_at(target, source, stamp)
        except TransformException as error:
            # Late samples may cure it, and so does a newer time that they have in common.
            error.blocked_on = (*(error.blocked_on or ()), *(
                (edge.child, stamp + 1) for edge in path.slowest_edges()))
            raise

    def _kept_path(self, target: str, source: str) -> Path | None:
        try:
            return self._paths.get((target, source))
        except TypeError:  # not hashable, such as a list: check_frame raises an error for it
            return None

    def _find_path(self, target: str, source: str, stamp: int | None) -> Path:
        """Return the way at a stamp (None: by the newest samples); keep it if it never changes."""
        path = Path(*self.branches(target, source, stamp).edges())
        if path.fixed:
            if len(self._paths) >= _MAX_PATHS:
                self._paths.clear()
            self._paths[target, source] = path
        return path

    def blockers(self, target: str, source: str, stamp: int) -> tuple[Blocker, ...]:
        """Return what may change the answer at a stamp; empty if nothing ever can."""
        return blockers(self.histories, target, source, stamp) or ()

    @property
    def was_rehung(self) -> bool:
        """Return whether a frame hangs elsewhere than before, at a time that can be asked for."""
        if self._was_rehung is None:
            self._was_rehung = not all(
                history.fixed_parent for history in self.histories.values())
        return self._was_rehung

    def check_frame(self, argument: str, frame: str) -> None:
        """
        Raise an error if a query cannot use a frame name.

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

    def branches(self, target: str, source: str, stamp: int | None) -> Branches:
        """
        Return the climbs from two frames to where they meet.

        :param stamp: nanoseconds; None goes by the newest samples.

        Errors are those of ``newest_path`` and ``pose_at``.
        """
        self.check_frame('target_frame', target)
        self.check_frame('source_frame', source)
        branches = climb_both(self.histories, target, source, stamp)
        if not branches.meet:
            raise self._not_joined(branches, target, source, stamp)
        return branches

    def _not_joined(self, branches: Branches, target: str, source: str,
                    stamp: int | None) -> TransformException:
        """Return what tf2 says of two climbs that do not meet."""
        error: TransformException | None = None
        if stamp is not None:
            error = self._why_stuck(branches, target, source, stamp)
        if error is None:
            error = ConnectivityException(
                f'Could not find a connection between {target!r} and {source!r} because they '
                f'are not part of the same tree: {target!r} hangs on {branches.target.top!r}, '
                f'{source!r} on {branches.source.top!r}',
                hint='Tf has two or more unconnected trees: who should publish the edge between '
                'them?')
        error.blocked_on = ANY_STRUCTURE if stamp is None else blockers(
            self.histories, target, source, stamp)
        return error

    def _why_stuck(self, branches: Branches, target: str, source: str,
                   stamp: int) -> ExtrapolationException | None:
        """Return which edge has no data for a stamp; None if both climbs got to a root."""
        stuck = [history for climb in branches
                 if moves(history := self.histories.get(climb.top))]
        if not stuck:
            return None
        # If the frames are joined now, the edge to name lies between them, not above.
        now = climb_both(self.histories, target, source, None)
        between = Path(*now.edges()).without_data(stamp) if now.meet else []
        return furthest_from_cure(between or stuck, stamp).extrapolation(stamp)

    # --- everything at once

    def poses_from(self, target: str, stamp: int) -> dict[str, PoseTuple]:
        """
        Return ``target_T_frame`` for every frame that has one at a stamp.

        :param stamp: nanoseconds; 0 is a time here.
        :raises LookupException: nobody published the target.
        :raises InvalidArgumentException: a name that cannot be a frame.
        """
        self.check_frame('target_frame', target)
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

    def newest_of_all(self, target: str) -> int:
        """Return the newest time that all moving edges of a frame's tree have data for, or 0."""
        self.check_frame('target_frame', target)
        stamps = [history.latest_stamp for history, *_ in self._steps_from(target, None)
                  if not history.is_static and history.latest_stamp is not None]
        return min(stamps, default=LATEST)

    def _steps_from(self, target: str, stamp: int | None) -> list[Step]:
        """Return the edges in an order that reaches one end of each before its turn."""
        if target in self._steps:
            return self._steps[target]
        fixed = not self.was_rehung
        neighbours: dict[str, list[Step]] = {}
        for child, history in self.histories.items():
            parent = history.parent if fixed or stamp is None else history.parent_at(stamp)
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
        if fixed:
            self._steps[target] = steps
        return steps

    def copy(self) -> 'Tree':
        """Return a tree of its own with the same samples."""
        twin = Tree(self.cache_time, self.max_frames, self.max_name_bytes)
        twin.histories = {child: history.copy() for child, history in self.histories.items()}
        twin.frames = dict(self.frames)
        return twin

    # --- forgetting

    def clear(self) -> None:
        """Forget what moves; frame names and static edges stay, as in tf2."""
        for history in self.histories.values():
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
        if not any(history.has_named(frame) for history in self.histories.values()):
            del self.frames[frame]
        self._structure_changed()
        return True


def _goes_back(history: History, parent: str, authority: str) -> bool:
    """Return whether a frame returns to a parent and several publishers may be behind it."""
    return (is_ambiguous(authority) and moves(history)
            and history.has_named(parent))


def _time_of(history: History | None, stamp: int, static: bool) -> tuple[int, int]:
    """Return the stretch of time in which a new sample would name the parent."""
    if static:
        return BEGINNING, FOREVER
    return stamp, FOREVER if history is None else history.next_stamp(stamp)
