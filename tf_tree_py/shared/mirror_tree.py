# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The tree of another process, edge by edge.

A new state only replaces the record here. An edge is made to lie on the samples of its row when
its history is taken out of ``histories``, or found on a path: most lookups need few edges of a
tree. All of this is done with the lock of the tree; but ``routes`` are also read without it. See
``mirror``.
"""

from array import array
from bisect import bisect_left
from collections.abc import ItemsView, Iterable, ValuesView
from contextlib import AbstractContextManager
from typing import NoReturn, TypeVar

from tf_tree_py.core.edges.packed import Columns, POSE_FLOATS
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import BEGINNING, FOREVER
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.path import Path
from tf_tree_py.core.tree.path_finder import MAX_PATHS, PathFinder, Spanning
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.edges import Names

from . import layout
from .attachment import Attachment
from .block_samples import owned
from .directory import Directory, Entry
from .errors import SharedTreeException

_CAPACITY = 2 ** 32 - 1
_NOTHING = Columns(memoryview(array('q')), memoryview(array('d')), None, ())
_unpack_row = layout.row_struct.unpack_from
_Companion = TypeVar('_Companion', bound=Companion)


class _Edge:
    """
    An edge, and where its samples are.

    :ivar at: where its row is in the record, bytes.
    :ivar row: that of the state that is shown; see ``layout.ROW_WORDS``.
    :ivar size: that of its row, if new samples are only added in its block; otherwise -1, and the
        attributes below have no meaning.
    """

    __slots__ = ('entry', 'history', 'at', 'row', 'size', 'samples', 'stamps', 'poses')

    samples: Samples
    stamps: 'memoryview[int]'
    poses: 'memoryview[float]'

    def __init__(self, entry: Entry, history: History, at: int) -> None:
        self.entry, self.history, self.at = entry, history, at
        self.row: tuple[int, ...] = ()
        self.size = -1


class _Histories(dict[str, History]):
    """The histories by child frame; those that are taken out are those of the newest state."""

    def __init__(self, attachment: Attachment) -> None:
        super().__init__()
        self._attachment = attachment
        self._edges: dict[str, _Edge] = {}
        self._directory = Directory()
        self._record, self._steady = b'', BEGINNING

    def replace(self, directory: Directory) -> None:
        """Replace all edges by those of a directory, still without samples."""
        self.clear()
        self._directory = directory
        for entry in directory.edges:
            self[entry.child] = _history_of(entry, directory.cache_time)
        self._edges = {entry.child: _Edge(entry, history, layout.row_at(index))
                       for index, (entry, history) in enumerate(
                           zip(directory.edges, super().values(), strict=True))}

    def use(self, record: bytes, steady: int) -> None:
        """
        Use the record of a new state.

        :param steady: see ``layout.Root``.
        :raises ValueError: it does not fit the directory.
        """
        if len(record) != layout.row_at(len(self)):
            raise ValueError('the rows do not fit the directory')
        self._record, self._steady = record, steady

    def edges_of(self, path: Path) -> list[_Edge]:
        """Return the moving edges of a path."""
        return [self._edges[history.child] for history in path.moving]

    def begin_of(self, edges: list[_Edge]) -> int:
        """Return the first stamp from which new samples change no pose of some edges."""
        begin = BEGINNING
        for edge in edges:
            if edge.size == -1:
                return FOREVER
            # The sample before a stamp must not expire.
            stamps = edge.samples.stamps
            first = bisect_left(stamps, self._steady)
            begin = max(begin, stamps[first] if first < len(stamps) else FOREVER)
        return begin

    def bring_up(self, edges: Iterable[_Edge]) -> None:
        """
        Let edges lie on the samples of the newest state.

        :raises SharedTreeException: the file is damaged.
        """
        record, names = self._record, self._directory.names
        cache_time = self._directory.cache_time
        try:
            for edge in edges:
                row = _unpack_row(record, edge.at)
                if row == edge.row:
                    continue
                offset, size, samples, authority = row
                count = samples >> 1
                if edge.size == size and 1 < count <= size & _CAPACITY:
                    # The common case, which takes most of the time of a reader.
                    stamps = edge.stamps[:count]
                    edge.samples.grow_to(stamps, edge.poses[:POSE_FLOATS * count],
                                         stamps[samples % 2 - 2] - cache_time)
                else:
                    self._lie(edge, offset, size, samples)
                edge.history.authority = names[authority]
                edge.row = row
        except (IndexError, ValueError) as error:
            raise self._attachment.damaged(str(error)) from error

    def bring_up_all(self) -> None:
        """Let all edges lie on the samples of the newest state; see ``bring_up``."""
        self.bring_up(self._edges.values())

    def _lie(self, edge: _Edge, offset: int, size: int, samples: int) -> None:
        """Let a history lie on the block of its row; see ``layout.ROW_WORDS``."""
        history, entry, names = edge.history, edge.entry, self._directory.names
        edge.size = -1
        if not isinstance(history, Samples):
            return
        history.late = BEGINNING
        count = samples >> 1
        if not count:
            history.lie_on(_NOTHING, None)
            return
        capacity = size & _CAPACITY
        if not (count <= capacity and self._attachment.holds(
                offset, layout.block_bytes(capacity, entry.coded))):
            raise ValueError('a block is outside of the file')
        block = layout.block_at(self._attachment.memory, offset, capacity, entry.coded)
        all_poses = block.poses.cast('d')
        stamps, poses = block.stamps[:count], all_poses[:POSE_FLOATS * count]
        # The newest sample has been late, or is as usual: -1 or -2.
        before = samples % 2 - 2
        horizon = (BEGINNING if count + before < 0
                   else stamps[before] - self._directory.cache_time)
        parents, parent = None, entry.parent
        if entry.coded:
            parents = Names(block.codes[:count], names)
            parent = None if stamps[-1] in entry.ends else parents[-1]
        else:
            edge.samples, edge.stamps, edge.poses = history, block.stamps, all_poses
        history.lie_on(Columns(stamps, poses, parents, entry.ends), parent, horizon)
        if not entry.coded:
            edge.size = size  # at the end, because an interrupt may come before

    def __getitem__(self, child: str) -> History:
        history = super().__getitem__(child)
        self.bring_up((self._edges[child],))
        return history

    def get(self, child: str, default: None = None) -> History | None:  # type: ignore[override]
        """Return a history; None if there is none."""
        try:
            return self[child]
        except KeyError:
            return None

    def values(self) -> 'ValuesView[History]':  # type: ignore[override]
        """Return all histories."""
        self.bring_up_all()
        return super().values()

    def items(self) -> 'ItemsView[str, History]':  # type: ignore[override]
        """Return all histories by child frame."""
        self.bring_up_all()
        return super().items()


def _history_of(entry: Entry, cache_time: int) -> History:
    if entry.pose is not None:
        return StaticHistory(entry.child, str(entry.parent), entry.pose)
    return Samples(entry.child, cache_time)


class _Route:
    """
    A path, and the stamps for which its poses stay the same until the next change.

    :ivar edges: those that move.
    :ivar begin: the first of the stamps.
    :ivar end: the one after the last.
    :ivar state: the number of the state whose samples the edges lie on, or of one before it.
    """

    __slots__ = ('path', 'edges', 'begin', 'end', 'state')

    def __init__(self, path: Path, edges: list[_Edge], begin: int) -> None:
        self.path, self.edges, self.begin = path, edges, begin
        self.end, self.state = BEGINNING, -1

    def use(self, state: int) -> None:
        """Use the samples of a state, to which the edges were brought up."""
        self.state = state
        if self.begin < FOREVER:
            self.end = min([edge.samples.stamps[-1] for edge in self.edges], default=FOREVER)


class _Paths(PathFinder):
    """
    Finds paths; those in ``_paths`` have edges as of the newest state.

    :ivar routes: the paths found since the last change, without those that depend on the stamp.
    """

    _histories: _Histories

    def __init__(self, histories: _Histories, frames: dict[str, None]) -> None:
        super().__init__(histories, frames)
        self.routes: dict[tuple[str, str], _Route] = {}
        self._state = -1

    def forget(self) -> None:
        """Remove all cached paths, because the tree has changed."""
        super().forget()
        self.routes.clear()

    def use(self, state: int) -> None:
        """Bring the edges of each path up to a state when it is used next."""
        self._state = state
        self._paths.clear()

    def _find_fixed_path(self, target: str, source: str) -> Path | None:
        route = self.routes.get((target, source))
        if route is None:
            path = super()._find_fixed_path(target, source)
            if path is None:
                return None
            edges = self._histories.edges_of(path)
            route = _Route(path, edges, self._histories.begin_of(edges))
            if len(self.routes) >= MAX_PATHS:
                self.routes.clear()
            self.routes[target, source] = route
        self._histories.bring_up(route.edges)
        route.use(self._state)
        self._paths[target, source] = route.path
        return route.path


class _Spanning(Spanning):
    """The order in which all frames are reached, with edges as of the newest state."""

    _histories: _Histories

    def poses_from(self, target: str, stamp: int) -> dict[str, PoseTuple]:
        """Return the poses of all frames; see ``Spanning``."""
        self._histories.bring_up_all()
        return super().poses_from(target, stamp)

    def latest_of_all(self, target: str) -> int:
        """Return the newest time for which all edges have data; see ``Spanning``."""
        self._histories.bring_up_all()
        return super().latest_of_all(target)


class MirrorTree(Tree):
    """A tree that shows that of another process, so nothing can be changed here."""

    histories: _Histories
    paths: _Paths

    def follow(self, attachment: Attachment, lock: AbstractContextManager[None]) -> None:
        """
        Show the tree of another process from now on; this one has no frames yet.

        :param lock: with it, the tree is that of the other process.
        """
        self._lock, self._changed = lock, -1
        when_empty = self.paths.when_empty
        self.histories = _Histories(attachment)
        self.paths = _Paths(self.histories, self.frames)
        self.paths.when_empty = when_empty
        self.spanning = _Spanning(self.histories, self.paths)

    def show(self, directory: Directory) -> None:
        """Replace all edges by those of a directory, still without samples."""
        self.cache_time, self.cleared = directory.cache_time, directory.cleared
        self.histories.replace(directory)
        self.frames.clear()
        self.frames.update(dict.fromkeys(directory.frames))
        self._structure_changed()

    def use(self, record: bytes, root: layout.Root) -> None:
        """
        Show the samples of a record from now on.

        :raises ValueError: it does not fit the directory.
        """
        self.histories.use(record, root.steady)
        if root.changed != self._changed:
            self.paths.forget()
        self.paths.use(root.state)
        self._changed = root.changed

    def complete(self, error: TransformException, target_frame: str,
                 source_frame: str | None) -> None:
        """Complete the error of a lookup; see ``Tree``."""
        if self.cleared is None or isinstance(error, SharedTreeException):
            super().complete(error, target_frame, source_frame)
        else:
            with self._lock:  # histories are taken out
                super().complete(error, target_frame, source_frame)

    def copy(self) -> Tree:
        """Return an independent tree with the same samples, in memory of this process."""
        twin = super().copy()
        for history in twin.histories.values():
            if isinstance(history, Samples):
                owned(history)
        return twin

    def companion_or_new(self, cls: type[_Companion]) -> _Companion:
        """Return a companion that is a cache; others would not follow the other process."""
        if cls.key:
            self._refuse()
        return super().companion_or_new(cls)

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise SharedTreeException(
            'This tree is that of another process, which shares it, and cannot be changed here: '
            'publish transforms on /tf or /tf_static, or use a buffer that is not shared')

    append = append_batch = insert = history_to_extend = insert_history = _refuse
    replace = interpolate = clear = remove = _refuse
