# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The lock of a tree that shows that of another process, for those that look up in it.

Nothing is copied but a record: the histories of the tree lie on the memory of the writer; see
``mirror_tree``. They are those of one state, the newest when the lock is acquired, until its
release.

A pose between samples that are known already is the same in each state with nothing new but
samples. So it is returned without a look at the newest state, and without the lock.

What was read may have been overwritten meanwhile, if this process was stopped for long. Then, at
the release of the lock, the state is no longer intact, and ``LapsedException`` is raised.
"""

from collections.abc import Callable
from time import monotonic_ns
from types import TracebackType
from typing import NamedTuple, NoReturn
import zlib

from tf_tree_py.core import fork_locks
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.stamp import LATEST

from . import layout
from .attachment import Attachment
from .directory import Directory, from_bytes
from .errors import LapsedException, SharedTreeException
from .layout import CHANGED, fence, INTACT, ORDERED, STATE
from .mirror_tree import MirrorTree

# After this time, nanoseconds, a thread that acquires the lock once more does not go on to use the
# same state. A keyboard interrupt may have left the depth too large, so it would use it forever.
_LONGEST_HOLD = 1_000_000_000
_ENDED = 'The process that shared the tree has ended it during this lookup: ask again'
_TOO_LONG = 'This lookup has held the lock for so long that its data is old: ask again'
_LAPSED = ('The memory that this lookup was reading has been used again meanwhile, because this '
           'process was stopped, or is too slow: ask again')
WhyUnfit = Callable[[Directory], str]


class Mirror:
    """
    The lock of a tree that is kept like that of another process; see above.

    The thread that holds it may acquire it again: then the tree stays as it is.

    :cvar attempts: to copy a record; each fails only if the writer writes many states during it.
    :ivar plain: the lock itself, for those that do not look into the tree.
    :ivar words: of the header.
    :ivar directory: of the state that is shown.
    :ivar state: its number.
    """

    __slots__ = ('plain', 'words', 'directory', 'state', '_acquire', '_release', '_depth',
                 '_holds', '_since', '_is_void', '_attachment', '_tree', '_routes', '_shown',
                 '_edition', '_changed', '_alive_until', '_why_unfit')

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
        # How often the thread that holds it has acquired it; and how often it was acquired.
        self._depth = self._holds = 0
        # When that was; and whether its holds were given up, so that no answer of them is right.
        self._since, self._is_void = 0, False
        self._attachment = attachment
        self._tree = tree
        tree.follow(attachment, self)
        self._routes = tree.paths.routes
        self._begin()

    def _begin(self) -> None:
        """Begin with another file."""
        # Of the state that is shown: its word, and the numbers of itself, of its directory, and of
        # its last change.
        self._shown = self.state = self._edition = self._changed = -1
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
            self._shown = self._edition = self._changed = -1

    def __enter__(self) -> None:
        self._acquire()
        now = monotonic_ns()
        # The functions of a void hold are ending, or an interrupt has ended them.
        if self._depth and not self._is_void:
            if now - self._since > _LONGEST_HOLD:
                self._give_up()
            self._depth += 1
            return
        self._depth = 1
        self._holds += 1
        self._since = now
        if self.words[STATE] != self._shown or now > self._alive_until:
            try:
                self._refresh(now)
            except BaseException:
                self._depth = 0
                self._release()
                raise

    def _give_up(self) -> NoReturn:
        """Let all holds of this thread end with an error; this is not another one."""
        self._is_void = True
        self._release()
        error = LapsedException(_TOO_LONG)
        error.is_inside = True
        raise error

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._depth = depth = max(self._depth - 1, 0)
        is_void, state, words = self._is_void and not depth, self.state, self.words
        if is_void:
            self._is_void = False
        self._release()
        if not ORDERED:
            fence()
        if (words[INTACT] > state or is_void) and (kind is None or issubclass(kind, Exception)):
            error = LapsedException(_TOO_LONG if is_void else _LAPSED)
            error.is_inside = depth > 0
            raise error
        if isinstance(error, LapsedException):
            error.is_inside = depth > 0

    def known(self, target: str, source: str, stamp: int) -> tuple[int, PoseTuple] | None:
        """
        Return a stamp and a pose, without the lock; None if the lock is needed.

        Another thread may change the tree meanwhile. It holds the lock for that, which is noticed
        at the end; until then nothing is changed here.
        """
        holds, words = self._holds, self.words
        try:
            route = self._routes[target, source]
        except (KeyError, TypeError):  # TypeError: not hashable
            return None
        state = route.state
        if self._depth or monotonic_ns() > self._alive_until or words[CHANGED] != self._changed:
            return None
        if stamp == LATEST:
            if words[STATE] != self._shown or state != self.state:
                return None
        elif not route.begin <= stamp < route.end or words[STATE] < 0:
            return None
        if not ORDERED:
            fence()
        try:
            if stamp == LATEST:
                stamp = route.path.latest_common_time()
            pose = route.path.pose_at(stamp)
        except Exception:  # noqa: B902 - whatever a change brings about
            return None
        if not ORDERED:
            fence()
        return None if words[INTACT] > state or holds != self._holds else (stamp, pose)

    # --- a new state

    def _refresh(self, now: int) -> None:
        """
        Look for a writer, and show its newest state.

        :param now: nanoseconds of the monotonic clock.
        :raises SharedTreeException: there is no writer any more, or the file is damaged.
        """
        if self.words[INTACT] > self.state:
            self._tree.paths.forget()  # what was found out about a path may be wrong
        if now > self._alive_until or self.words[STATE] < 0:
            self._attachment.check()
            if self.words is not self._attachment.words:
                self._begin()
            self._alive_until = self._attachment.alive_until
        if self.words[STATE] != self._shown:
            self._show_newest()

    def _show_newest(self) -> None:
        found = self._newest()
        root = found.root
        try:
            if found.text is not None:
                self._show(from_bytes(found.text))
            self._tree.use(found.record, root)
        except (IndexError, ValueError) as error:
            raise self._attachment.damaged(str(error)) from error
        self._edition, self._changed = root.edition, root.changed
        self._shown, self.state = found.word, root.state

    def _newest(self) -> '_Found':
        for _ in range(self.attempts):
            word = self.words[STATE]
            if word < 0:
                raise LapsedException(_ENDED)  # the next check says why
            state = word >> 16
            if word != layout.state_word(state):
                raise self._attachment.damaged('the number of its state is wrong')
            fence()
            place = layout.place_of_record(state)
            record = self._read(self.words[place], self.words[place + 1])
            root = layout.root_of(record)
            text = (self._read(root.directory, root.directory_bytes)
                    if root.edition != self._edition else None)
            fence()
            if ((self.words[STATE] >> 16) - state < layout.RECORDS - 2
                    and self.words[INTACT] <= state):
                break
        else:
            raise SharedTreeException(
                f'The shared tree changed during each of {self.attempts} attempts to read it, '
                'because this process was stopped, or is too slow: ask again')
        if (root.state != state or root.checksum != zlib.crc32(record[layout.WORD:])
                or text is not None and root.directory_sum != zlib.crc32(text)):
            raise self._attachment.damaged('a checksum is wrong')
        return _Found(word, root, record, text)

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
    record: bytes
    text: bytes | None
