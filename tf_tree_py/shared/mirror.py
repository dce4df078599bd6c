# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The tree of another process, for those that look up in it.

Nothing is copied but the table: the histories of this tree lie on the memory of the writer. They
are those of the newest state whenever the lock is acquired, and do not change before its release.

What was read may have been overwritten meanwhile, if this process was stopped for long. Then, at
the release of the lock, the state is no longer intact, and ``LapsedException`` is raised.
"""

from array import array
from collections.abc import Callable
from time import monotonic_ns
from types import TracebackType
from typing import NoReturn, TypeVar
import zlib

from tf_tree_py.core import fork_locks
from tf_tree_py.core.edges.packed import Columns, POSE_FLOATS
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.edges.static import StaticHistory
from tf_tree_py.core.stamp import BEGINNING
from tf_tree_py.core.tree.companions import Companion
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.edges import Names

from . import layout
from .attachment import Attachment
from .block_samples import owned
from .directory import Directory, Entry, from_bytes
from .errors import LapsedException, SharedTreeException
from .layout import fence, INTACT, ORDERED, ROW_WORDS, STATE

# After this time, nanoseconds, the tree is brought up to date although the lock seems to be held:
# an interrupt may have left the depth too large.
_ABANDONED = 1_000_000_000
_CAPACITY = 2 ** 32 - 1
_LAPSED = ('The memory that this lookup was reading has been used again meanwhile, because this '
           'process was stopped, or is too slow: ask again')
WhyUnfit = Callable[[Directory], str]
_Companion = TypeVar('_Companion', bound=Companion)
_NOTHING = Columns(memoryview(array('q')), memoryview(array('d')), None, ())


class MirrorTree(Tree):
    """A tree that shows that of another process, so nothing can be changed here."""

    def show(self, directory: Directory) -> None:
        """Replace all edges by those of a directory, still without samples."""
        self.cache_time, self.cleared = directory.cache_time, directory.cleared
        self.histories.clear()
        self.frames.clear()
        self.frames.update(dict.fromkeys(directory.frames))
        for entry in directory.edges:
            self.histories[entry.child] = _history_of(entry, directory.cache_time)
        self._structure_changed()

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


def _history_of(entry: Entry, cache_time: int) -> History:
    if entry.pose is not None:
        return StaticHistory(entry.child, str(entry.parent), entry.pose)
    return Samples(entry.child, cache_time)


class Mirror:
    """
    The lock of a tree that is kept like that of another process; see above.

    The thread that holds it may acquire it again: then the tree stays as it is.

    :cvar attempts: to copy a table; each fails only if the writer writes many states during it.
    :ivar plain: the lock itself, for those that do not look into the tree.
    :ivar words: of the header.
    :ivar directory: of the state that is shown.
    """

    __slots__ = ('plain', 'words', 'directory', '_acquire', '_release', '_depth', '_since',
                 '_attachment', '_tree', '_shown', '_state', '_edition', '_alive_until', '_edges',
                 '_why_unfit')

    attempts = 1_000

    def __init__(self, attachment: Attachment, tree: MirrorTree, plain: fork_locks.Lock,
                 why_unfit: WhyUnfit = lambda _: '') -> None:
        """
        Show what another process shares, whenever the lock is acquired.

        :param tree: without edges.
        :param plain: a re-entrant lock, the one of the tree until now.
        :param why_unfit: returns why the tree of a writer must not be shown, as a clause; ''
            if it may.
        """
        self._why_unfit = why_unfit
        self.plain = plain
        self._acquire, self._release = self.plain.acquire, self.plain.release
        self._depth, self._since = 0, 0
        self._attachment = attachment
        self._tree = tree
        self._begin()

    def _begin(self) -> None:
        """Begin with another file."""
        # The word of the state that is shown, its number, and that of its directory.
        self._shown = self._state = self._edition = -1
        self.words = self._attachment.words
        self._alive_until = 0
        self.directory = Directory()
        self._edges: list[_Edge] = []

    def close(self) -> None:
        """Let later lookups raise an error, and free the memory."""
        with self.plain:
            self._attachment.close()
            self._tree.show(Directory())
            self._begin()

    def look_again(self) -> None:
        """Compare the tree of the writer again with what is needed."""
        with self.plain:
            self._shown = self._edition = -1

    def __enter__(self) -> None:
        self._acquire()
        now = monotonic_ns()
        depth = self._depth
        self._depth = depth + 1
        if depth and now - self._since < _ABANDONED:
            return
        self._since = now
        if self.words[STATE] != self._shown or now > self._alive_until:
            try:
                self._refresh()
            except BaseException:
                self._depth = depth
                self._release()
                raise

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._depth -= 1
        state, words = self._state, self.words
        self._release()
        if not ORDERED:
            fence()
        if words[INTACT] > state and (kind is None or issubclass(kind, Exception)):
            raise LapsedException(_LAPSED)

    # --- a new state

    def _refresh(self) -> None:
        """
        Show the newest state.

        :raises SharedTreeException: there is no writer any more, or the file is damaged.
        """
        lapsed = self._depth > 1 and self.words[INTACT] > self._state
        self._attachment.check()
        if self.words is not self._attachment.words:
            self._begin()
        self._alive_until = self._attachment.alive_until
        if self.words[STATE] != self._shown:
            self._take_over()
        if lapsed:  # so what the outer hold has read is not believed
            raise LapsedException(_LAPSED)

    def _take_over(self) -> None:
        for _ in range(self.attempts):
            word = self.words[STATE]
            state = word >> 16
            if word != layout.state_word(state):
                raise self._attachment.damaged('the number of its state is wrong')
            fence()
            root = layout.Root(*layout.root_struct.unpack_from(
                self._attachment.memory, layout.root_at(state)))
            table = self._read(root.table, layout.WORD * ROW_WORDS * root.rows)
            text = (self._read(root.directory, root.directory_bytes)
                    if root.edition != self._edition else None)
            fence()
            if ((self.words[STATE] >> 16) - state < layout.ROOTS - 2
                    and self.words[INTACT] <= state):
                break
        else:
            raise SharedTreeException(
                f'The shared tree changed during each of {self.attempts} attempts to read it, '
                'because this process was stopped, or is too slow: ask again')
        if (root.state != state or root.checksum != layout.checksum(state, root.edition, table)
                or text is not None and root.directory_sum != zlib.crc32(text)):
            raise self._attachment.damaged('a checksum is wrong')
        try:
            self._show(root, table, text)
        except (IndexError, ValueError) as error:
            raise self._attachment.damaged(str(error)) from error
        self._shown, self._state = word, state

    def _read(self, offset: int, size: int) -> bytes:
        """Return a copy of memory; b'' if there is none, because this state is gone already."""
        attachment = self._attachment
        return (bytes(attachment.memory[offset:offset + size])
                if attachment.holds(offset, size) else b'')

    def _show(self, root: layout.Root, table: bytes, text: bytes | None) -> None:
        """Let the histories lie on the samples of a state whose checksums are right."""
        if text is not None:
            self.directory = from_bytes(text)
            why = self._why_unfit(self.directory)
            if why:
                raise SharedTreeException(f'{self._attachment.who} cannot be used here: {why}')
            self._tree.show(self.directory)
            self._edges = list(map(_Edge, self.directory.edges, self._tree.histories.values()))
        if root.rows != len(self._edges):
            raise ValueError('the table does not fit the directory')
        cache_time = self._tree.cache_time
        # Not numpy, whose first call after a pause takes longer than this loop over 38 edges.
        for edge, row in zip(self._edges, layout.row_struct.iter_unpack(table), strict=True):
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
                self._show_edge(edge, offset, size, samples)
            edge.history.authority = self.directory.names[authority]
            edge.row = row
        self._edition = root.edition

    def _show_edge(self, edge: '_Edge', offset: int, size: int, samples: int) -> None:
        """Let a history lie on the samples of its row; see ``layout.ROW_WORDS``."""
        history, entry, names = edge.history, edge.entry, self.directory.names
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
        horizon = BEGINNING if count + before < 0 else stamps[before] - self._tree.cache_time
        parents, parent = None, entry.parent
        if entry.coded:
            parents = Names(block.codes[:count], names)
            parent = None if stamps[-1] in entry.ends else parents[-1]
        else:
            edge.samples, edge.size = history, size
            edge.stamps, edge.poses = block.stamps, all_poses
        history.lie_on(Columns(stamps, poses, parents, entry.ends), parent, horizon)


class _Edge:
    """
    An edge, and where its samples are.

    :ivar row: that of the state that is shown; see ``layout.ROW_WORDS``.
    :ivar size: that of its row, if new samples are only added in its block; otherwise -1, and the
        attributes below have no meaning.
    """

    __slots__ = ('entry', 'history', 'row', 'size', 'samples', 'stamps', 'poses')

    samples: Samples
    stamps: 'memoryview[int]'
    poses: 'memoryview[float]'

    def __init__(self, entry: Entry, history: History) -> None:
        self.entry = entry
        self.history = history
        self.row: tuple[int, ...] = ()
        self.size = -1
