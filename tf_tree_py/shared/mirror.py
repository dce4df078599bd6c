# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The lock of a tree that shows that of another process, for those that look up in it.

Nothing is copied but the table: the histories of the tree lie on the memory of the writer; see
``mirror_tree``. They are those of one state, not older than the newest when the lock is acquired,
until its release.

If there is nothing new but samples, that state is not even looked at before it is needed: a pose
between samples that are known already is the same.

What was read may have been overwritten meanwhile, if this process was stopped for long. Then, at
the release of the lock, the state is no longer intact, and ``LapsedException`` is raised.
"""

from collections.abc import Callable
from time import monotonic_ns
from types import TracebackType
from typing import NamedTuple
import zlib

from tf_tree_py.core import fork_locks

from . import layout
from .attachment import Attachment
from .directory import Directory, from_bytes
from .errors import LapsedException, SharedTreeException
from .layout import CHANGED, fence, INTACT, ORDERED, STATE
from .mirror_tree import MirrorTree

# After this time, nanoseconds, the tree is brought up to date although the lock seems to be held:
# an interrupt may have left the depth too large.
_ABANDONED = 1_000_000_000
_CHANGED = 'The shared tree has changed during this lookup: ask again'
_LAPSED = ('The memory that this lookup was reading has been used again meanwhile, because this '
           'process was stopped, or is too slow: ask again')
WhyUnfit = Callable[[Directory], str]


class Mirror:
    """
    The lock of a tree that is kept like that of another process; see above.

    The thread that holds it may acquire it again: then the tree stays as it is.

    :cvar attempts: to copy a table; each fails only if the writer writes many states during it.
    :ivar plain: the lock itself, for those that do not look into the tree.
    :ivar words: of the header.
    :ivar directory: of the state that is shown.
    :ivar state: its number.
    """

    __slots__ = ('plain', 'words', 'directory', 'state', '_acquire', '_release', '_depth',
                 '_since', '_attachment', '_tree', '_seen', '_shown', '_edition', '_changed',
                 '_read_state', '_alive_until', '_why_unfit')

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
        tree.follow(attachment, self)
        self._begin()

    def _begin(self) -> None:
        """Begin with another file."""
        # The word of the newest state that was seen, and of the state that is shown the word and
        # the numbers: its own, and those of its directory and its last change.
        self._seen = self._shown = self.state = self._edition = self._changed = -1
        # The oldest state that is read with the lock.
        self._read_state = -1
        self.words = self._attachment.words
        self._alive_until = 0
        self.directory = Directory()

    def close(self) -> None:
        """Let later lookups raise an error, and free the memory."""
        with self.plain:
            self._attachment.close()
            self._tree.show(Directory())
            self._begin()

    def look_again(self) -> None:
        """Compare the tree of the writer again with what is needed."""
        with self.plain:
            self._seen = self._shown = self._edition = self._changed = -1

    def __enter__(self) -> None:
        self._acquire()
        now = monotonic_ns()
        depth = self._depth
        self._depth = depth + 1
        if depth and now - self._since < _ABANDONED:
            return
        self._since = now
        word = self.words[STATE]
        if (word != self._seen or now > self._alive_until
                or self.words[INTACT] > self.state):  # the next state is being written
            # This function is the price of each lookup, so most of them need no other.
            if not ORDERED:
                fence()
            if (now <= self._alive_until and word >= 0 and self.words[CHANGED] == self._changed
                    and self.words[INTACT] <= self.state):
                self._seen = word
            else:
                try:
                    self._refresh(now, word)
                except BaseException:
                    self._depth = depth
                    self._release()
                    raise
        self._read_state = self.state

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._depth = depth = self._depth - 1
        state, words = self._read_state, self.words
        self._release()
        if not ORDERED:
            fence()
        if words[INTACT] > state and (kind is None or issubclass(kind, Exception)):
            error = LapsedException(_LAPSED)
            error.is_inside = depth > 0
            raise error
        if isinstance(error, LapsedException):
            error.is_inside = depth > 0

    def reads(self, state: int) -> bool:
        """Return whether the memory of an earlier state is intact, for those that now read it."""
        if self.words[INTACT] > state:
            return False
        self._read_state = min(self._read_state, state)
        return True

    def is_intact(self) -> bool:
        """Return whether what has been read with the lock is right so far."""
        fence()
        return self.words[INTACT] <= self._read_state

    # --- a new state

    def _refresh(self, now: int, word: int) -> None:
        """
        Look for a writer, and show its newest state.

        :param now: nanoseconds of the monotonic clock.
        :param word: of the state.
        :raises SharedTreeException: there is no writer any more, or the file is damaged.
        """
        lapsed = self._depth > 1 and self.words[INTACT] > self._read_state
        if now > self._alive_until or word < 0:
            self._attachment.check()
            if self.words is not self._attachment.words:
                self._begin()
            self._alive_until = self._attachment.alive_until
        if self.words[STATE] != self._shown:
            self._take_over(self._newest())
        if lapsed:  # so what the outer hold has read is not believed
            error = LapsedException(_LAPSED)
            error.is_inside = True
            raise error

    def catch_up(self) -> None:
        """
        Show the newest state, if it is not shown yet, and has nothing new but samples.

        :raises LapsedException: it has, so what the lock's holder already knows is out of date.
        :raises SharedTreeException: it cannot be read.
        """
        if self._seen == self._shown:
            return
        found = self._newest()
        if found.root.changed != self._changed:
            self._since = -_ABANDONED  # an interrupt may have left this hold
            raise LapsedException(_CHANGED)
        self._take_over(found)

    def _newest(self) -> '_Found':
        for _ in range(self.attempts):
            word = self.words[STATE]
            if word < 0:
                raise LapsedException(_CHANGED)  # it has ended, as the next check says
            state = word >> 16
            if word != layout.state_word(state):
                raise self._attachment.damaged('the number of its state is wrong')
            fence()
            root, checksum = layout.root_of(self._attachment.memory, state)
            table = self._read(root.table, layout.row_struct.size * root.rows)
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
        if (root.state != state or root.checksum != zlib.crc32(table, checksum)
                or text is not None and root.directory_sum != zlib.crc32(text)):
            raise self._attachment.damaged('a checksum is wrong')
        return _Found(word, root, table, text)

    def _take_over(self, found: '_Found') -> None:
        """Show a state whose checksums are right."""
        root = found.root
        try:
            if found.text is not None:
                self._show(from_bytes(found.text))
            self._tree.use(found.table, root)
        except (IndexError, ValueError) as error:
            raise self._attachment.damaged(str(error)) from error
        self._edition, self._changed = root.edition, root.changed
        self._seen = self._shown = found.word
        self.state = root.state

    def _show(self, directory: Directory) -> None:
        self.directory = directory
        why = self._why_unfit(directory)
        if why:
            raise SharedTreeException(f'{self._attachment.who} cannot be used here: {why}')
        self._tree.show(directory)

    def _read(self, offset: int, size: int) -> bytes:
        """Return a copy of memory; b'' if there is none, because this state is gone already."""
        attachment = self._attachment
        return (bytes(attachment.memory[offset:offset + size])
                if attachment.holds(offset, size) else b'')


class _Found(NamedTuple):
    """
    A state whose checksums are right.

    :ivar word: its number with check bits.
    :ivar text: the directory; None if it is that of the state that is shown.
    """

    word: int
    root: layout.Root
    table: bytes
    text: bytes | None
