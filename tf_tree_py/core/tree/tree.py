# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The structure of the tree: the edges, and their rule.

The rule: at any time a frame has one parent, and no edge closes a loop. An edge that would
close one is refused when it arrives, so lookups never encounter loops. ``edges`` stores the
samples, ``path`` composes poses, and the buffer has the lock: it is held in every method but
``complete``. ``paths`` and ``spanning`` share ``histories`` and ``frames``, so these stay the same
objects. What changes the edges, a parent or a static pose calls ``_structure_changed``; or else
lookups follow cached paths, and waiters sleep on.

The incidents of samples that change the tree, or are refused because they would, come last.
"""

from collections.abc import Sequence
from typing import cast, TypeVar

from .climb import Cleared, edges_to_clear, find_loop, Loop
from .companions import Companion
from .path_finder import PathFinder, Spanning
from ..edges.interpolation import Interpolation
from ..edges.packed import pack_pose
from ..edges.protocol import History, moves, MovingHistory
from ..edges.samples import interpolated, Samples
from ..edges.static import StaticHistory
from ..errors import TransformException
from ..geometry.poses import is_sound
from ..geometry.se3 import PoseTuple
from ..geometry.so3 import Array
from ..messages.incidents import Incident, is_ambiguous, Kind
from ..messages.sample import bad_name, Batch, Edge, Edges, Sample
from ..stamp import BEGINNING, FOREVER, format_span, format_stamp
from ..times import Stamps

_Companion = TypeVar('_Companion', bound=Companion)

# How many kinds of message have their edges cached, and how many edges in all. The limits hold
# even if a hostile publisher sends new ones all the time.
_MAX_KNOWN = 256
_MAX_KNOWN_EDGES = 20_000


class Tree:
    """
    All edges of a buffer, by child frame.

    The parent belongs to the sample, so the tree may change over time. A path on which no edge
    ever changed its parent is cached until the structure changes; ``version`` counts those
    changes. A sample older than all others of its edge is such a change, too.

    :ivar companions: the data beside the samples; most trees have none.
    :ivar histories: each child frame's samples.
    :ivar live: whether data may still arrive, so that a failed lookup may succeed later; a copy
        and a tree from a file are not live.
    :ivar frames: every frame name, in order of first appearance.
    :ivar paths: finds the path between two frames.
    :ivar spanning: computes the poses of all frames in one pass.
    :ivar cleared: the last time that ``clear`` was called, for errors; None if it never was.
    :cvar samples: the class of the histories that it makes.
    """

    samples: type[Samples] = Samples

    def __init__(self, cache_time: int, max_frames: int, max_name_bytes: int) -> None:
        self.cache_time = cache_time
        self.max_frames = max_frames
        self.max_name_bytes = max_name_bytes
        self.live = False
        self.histories: dict[str, History] = {}
        self.frames: dict[str, None] = {}
        self.version = 0
        self.companions: dict[type[Companion], Companion] = {}
        self.paths = PathFinder(self.histories, self.frames)
        self.spanning = Spanning(self.histories, self.paths)
        self._remarks = Remarks()
        self._known: dict[object, list[History | None]] = {}
        self.cleared: Cleared | None = None

    # --- inserting

    def append(self, sample: Sample, authority: str) -> bool:
        """
        Insert a sample that continues a known edge: the common case.

        :return: False in all other cases, without any change: see ``insert``.
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
        Insert the samples of a message that continue known edges, as ``append`` for each.

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
        """Return each edge's history if its parent is the same; cache those of a layout."""
        key = edges.key if type(edges) is Edges else None
        kept = self._known.get(key)
        if kept is not None:
            return kept
        histories = [(self.histories.get(child), parent) for parent, child in edges]
        known = [history if history is not None and history.parent == parent else None
                 for history, parent in histories]
        # Not cached with an unknown edge: it may always be refused, and its names may be long.
        if key is not None and None not in known:
            if (len(self._known) >= _MAX_KNOWN
                    or sum(map(len, self._known.values())) + len(known) > _MAX_KNOWN_EDGES):
                self._known.clear()
            self._known[key] = known
        return known

    def insert(self, parent: str, child: str, stamp: int, pose: PoseTuple,
               authority: str, static: bool) -> list[Incident]:
        """
        Insert one checked sample (see ``sample``), unless it breaks a rule.

        :return: refusals and remarks; nearly always empty.
        """
        history = self.histories.get(child)
        if history is not None and history.is_static == static and history.takes_samples and (
                history.continues(parent, stamp, pose) or history.is_too_old(stamp)):
            if history.insert(stamp, parent, pose):
                history.authority = authority
                return []
            return [too_old(history, parent, stamp, authority, self.cache_time)]
        return self._insert_new_edge(history, parent, child, stamp, pose, authority, static)

    def history_to_extend(self, parent: str, child: str, stamp: int) -> MovingHistory | None:
        """
        Return the history of an edge if samples from a stamp on can be added directly.

        It is None if one of them might change the structure, or be refused because of it.
        """
        history = self.histories.get(child)
        if (not moves(history) or not history.takes_samples or not history.fixed_parent
                or history.parent != parent):
            return None
        began = history.oldest_stamp
        assert began is not None
        if began <= stamp or find_loop(
                self.histories, parent, child, stamp, FOREVER, []) is None:
            return history
        return None

    def extend(self, history: MovingHistory, stamps: Stamps, poses: Array,
               authority: str) -> None:
        """Insert samples of an edge; see ``history_to_extend`` and ``MovingHistory.extend``."""
        began = history.oldest_stamp
        history.extend(stamps, poses)
        history.authority = authority
        assert began is not None
        if stamps.min() < began:
            self._structure_changed()

    def replace(self, history: History) -> None:
        """Replace an edge's history by another one with the same samples."""
        if self.histories.get(history.child) is not history:
            self.histories[history.child] = history
            self._structure_changed()

    def interpolate(self, child: str, interpolation: Interpolation) -> None:
        """
        Choose the interpolation of an edge, which need not have samples yet.

        :raises InvalidArgumentException: the edge is static or a curve.
        """
        self.histories[child] = interpolated(
            self.histories.get(child), child, self.cache_time, interpolation)
        self._structure_changed()

    def _insert_new_edge(self, history: History | None, parent: str, child: str, stamp: int,
                         pose: PoseTuple, authority: str, static: bool) -> list[Incident]:
        """Insert a sample that may change the structure."""
        cls = StaticHistory if static else Samples
        until = FOREVER if history is None else history.next_stamp(stamp)
        incidents = self._let_in(history, parent, child, stamp, authority, cls.described_as,
                                 (BEGINNING, FOREVER) if static else (stamp, until))
        if incidents and incidents[-1].refused:
            return incidents
        if static:
            self.histories[child] = StaticHistory(child, parent, pose, authority)
        else:
            if history is None or history.is_static or not history.takes_samples:
                history = self.samples(child, self.cache_time)
            unchanged = (not history.fixed_parent and history.parent == parent
                         and history.next_stamp(stamp) == FOREVER)
            history.insert(stamp, parent, pose)
            history.authority = authority
            self.histories[child] = history
            if unchanged:
                return incidents
        self._hung(parent, child)
        return incidents

    def insert_history(self, history: History, parent: str, begin: int,
                       authority: str) -> list[Incident]:
        """
        Replace an edge, whatever its kind, unless that breaks a rule.

        :param history: the new edge, with this parent from the stamp ``begin`` on.
        :return: refusals and remarks; nearly always empty.
        """
        incidents = self._let_in(self.histories.get(history.child), parent, history.child, begin,
                                 authority, history.described_as, (begin, FOREVER))
        if incidents and incidents[-1].refused:
            return incidents
        self.histories[history.child] = history
        self._hung(parent, history.child)
        return incidents

    def _let_in(self, history: History | None, parent: str, child: str, stamp: int,
                authority: str, described_as: str, time: tuple[int, int]) -> list[Incident]:
        """
        Return the refusal of an edge, or remarks on it.

        Silent edges that would close a loop with it are ended.

        :param time: the interval in which the parent is this one; see ``_close_loop``.
        """
        unknown = {frame for frame in (parent, child) if frame not in self.frames}
        bad = bad_name(parent, child, stamp, authority, self.max_name_bytes) if unknown else None
        if bad:
            return [bad]
        if len(self.frames) + len(unknown) > self.max_frames:
            return [Incident(
                Kind.TOO_MANY_FRAMES, parent, child, stamp, authority,
                f'the buffer already knows {len(self.frames)} frames, its limit (max_frames)')]
        silent: list[MovingHistory] = []
        if child in self.frames:  # otherwise it has no children
            loop = self._close_loop(parent, child, time, silent)
            if loop is not None:
                return [_loop_closed(loop, child, stamp, authority)]
        incidents = [_silent_edge_ended(edge, parent, child, stamp, authority)
                     for edge in silent]
        for edge in silent:
            edge.end()
        if silent:
            self._structure_changed()
        return incidents + self._remarks.on(
            history, parent, child, stamp, authority, described_as)

    def _hung(self, parent: str, child: str) -> None:
        """Add the frames of an edge, and remove all cached paths."""
        self.frames.setdefault(child)
        self.frames.setdefault(parent)
        self._structure_changed()

    def _structure_changed(self) -> None:
        self.version += 1
        self.paths.forget()
        self.spanning.forget()
        for companion in self.companions.values():
            companion.structure_changed()
        self._known.clear()

    def _close_loop(self, parent: str, child: str, time: tuple[int, int],
                    silent: list[MovingHistory]) -> Loop | None:
        """
        Return the loop that a new edge would close at some time, if any.

        If the child has no newer samples, a silent edge of the loop may give way to the new
        one.

        :param time: the interval with the new parent: from the first stamp up to, but
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

    def copy(self) -> 'Tree':
        """Return an independent tree with the same samples."""
        twin = Tree(self.cache_time, self.max_frames, self.max_name_bytes)
        twin.histories.update(
            (child, history.copy()) for child, history in self.histories.items())
        twin.frames.update(self.frames)
        for cls, companion in self.companions.items():
            copied = companion.copy()
            if copied is not None:
                twin.companions[cls] = copied
        return twin

    # --- companions

    def companion(self, cls: type[_Companion]) -> _Companion | None:
        """Return the companion of a class; None if the tree has none."""
        return cast('_Companion | None', self.companions.get(cls))

    def companion_or_new(self, cls: type[_Companion]) -> _Companion:
        """Return the companion of a class, which is created if the tree has none."""
        if cls not in self.companions:
            self.companions[cls] = cls()
        return cast('_Companion', self.companions[cls])

    # --- removing

    def clear(self, why: str) -> None:
        """
        Remove the samples of moving edges; frame names and static edges stay, as in tf2.

        :param why: the reason as a clause, for errors of lookups that fail because of it.
        """
        self.cleared = Cleared(why, edges_to_clear(self.histories))
        for history in self.histories.values():
            history.clear()
        for companion in self.companions.values():
            companion.clear(self.histories)
        self._structure_changed()

    def complete(self, error: TransformException, target_frame: str,
                 source_frame: str | None) -> None:
        """Add to the error of a lookup its frames, and the hint that is right for this tree."""
        error.in_lookup(target_frame, source_frame, self.live)
        if self.cleared is not None:
            self.cleared.explain(error, self.histories)

    def remove(self, frame: str) -> bool:
        """
        Remove a frame's edge to its parent, and its name unless it has children.

        :return: whether the frame was known.
        """
        self.histories.pop(frame, None)  # it may have an interpolation before its first sample
        if frame not in self.frames:
            return False
        for companion in self.companions.values():
            companion.remove(frame)
        if not any(history.has_named(frame) for history in self.histories.values()):
            del self.frames[frame]
        self._structure_changed()
        return True


# --- incidents

# The maximum number of reported conflicts; all are removed when it is exceeded.
_MAX_FIGHTS = 1_000


def _silent_edge_ended(edge: MovingHistory, parent: str, child: str, stamp: int,
                       authority: str) -> Incident:
    """Return the incident of a new edge that reverses a silent one."""
    assert edge.newest_stamp is not None
    return Incident(
        Kind.SILENT_EDGE_ENDED, parent, child, stamp, authority,
        f'it reverses the edge {edge.parent!r} -> {edge.child!r} from '
        f'{edge.authority!r}, whose newest sample is '
        f'{format_span(stamp - edge.newest_stamp)} older; that edge ends there, and its past '
        'is still available')


def _loop_closed(loop: Loop, child: str, stamp: int, authority: str) -> Incident:
    """Return the incident of an edge that was refused because it would close a loop."""
    parent = loop.edges[0].child
    way = ' -> '.join([child, parent, *loop.frames])
    kept = ', '.join(f'{above!r} -> {edge.child!r} from {edge.authority!r}'
                     for edge, above in zip(*loop, strict=True))
    return Incident(
        Kind.LOOP, parent, child, stamp, authority,
        f'each frame the child of the next, {way} is a loop; kept: {kept}. '
        'Two nodes disagree about which frame is the parent: stop one of the publishers')


def too_old(history: History, parent: str, stamp: int, authority: str,
            cache_time: int) -> Incident:
    """Return the incident of a sample that was refused because it is older than the window."""
    assert history.newest_stamp is not None
    return Incident(
        Kind.OLD_DATA, parent, history.child, stamp, authority,
        f'its stamp {format_stamp(stamp)} is {format_span(history.newest_stamp - stamp)} '
        f'older than the newest, {format_stamp(history.newest_stamp)}, and the buffer keeps '
        f'{format_span(cache_time)}; the last publisher was {history.authority!r}',
        history.newest_stamp)


class Remarks:
    """The incidents of accepted samples; each conflict about a parent is reported once."""

    def __init__(self) -> None:
        self._fights: set[tuple[str, str]] = set()

    def on(self, history: History | None, parent: str, child: str, stamp: int,
           authority: str, described_as: str) -> list[Incident]:
        """Return remarks on an accepted sample; each conflict about a parent only once."""
        if history is None or history.parent is None:
            return []
        remarks = []
        if history.described_as != described_as:
            remarks.append(Incident(
                Kind.KIND_CHANGE, parent, child, stamp, authority,
                f'it was {history.described_as} from {history.authority!r} and is now '
                f'{described_as}; '
                'its stored samples were removed'))
        if history.parent != parent and (child, parent) not in self._fights and (
                history.authority != authority or _goes_back(history, parent, authority)):
            if len(self._fights) > _MAX_FIGHTS:
                self._fights.clear()
            self._fights |= {(child, parent), (child, history.parent)}
            remarks.append(Incident(
                Kind.SECOND_PARENT, parent, child, stamp, authority,
                f'{history.authority!r} says that its parent is {history.parent!r}; '
                'every lookup through it depends on which message came last'))
        return remarks


def _goes_back(history: History, parent: str, authority: str) -> bool:
    """Return whether a frame returns to a parent, possibly because of several publishers."""
    return (is_ambiguous(authority) and moves(history)
            and history.has_named(parent))
