# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The writer's memory: a file that grows, and which parts of it are free.

What the newest state no longer refers to may still be read, so it is retired first. Where there is
no room elsewhere, it is used again after ``keep_s``, in which nearly all lookups end. Otherwise
the file grows, unless it is mostly retired, or there is no more memory.
"""

from bisect import insort
from collections import deque
from contextlib import suppress
import mmap
from operator import itemgetter
import os
from pathlib import Path
import secrets
import time
from typing import NamedTuple

from .errors import SharedTreeException
from .layout import BEAT, BEGUN, fence, INTACT, MAGIC, PAGE, PID, STATE, WHY, WHY_AT, WORD
from .place import opened, process_status, SHARED_MEMORY

# As many bytes may be retired, or as half of the file.
_RETIRED = 16_000_000
_GROWTH = 1 / 32
_LEAST_GROWTH = 16 * PAGE
_UNIT = 64  # a cache line: what two edges write is not in the same


class Room:
    """The free parts of a file, as offsets and sizes; neighbours are joined."""

    def __init__(self) -> None:
        self._free: list[tuple[int, int]] = []

    def add(self, offset: int, size: int) -> None:
        """Add a part that is not in use."""
        insort(self._free, (offset, size))
        index = self._free.index((offset, size))
        for left in (index, index - 1):
            if 0 <= left < len(self._free) - 1:
                (begin, length), (after, more) = self._free[left:left + 2]
                if begin + length == after:
                    self._free[left:left + 2] = [(begin, length + more)]

    def take(self, size: int) -> int | None:
        """Return the offset of a part of this size, of the smallest that is left; or None."""
        fitting = [part for part in self._free if part[1] >= size]
        if not fitting:
            return None
        offset, free = part = min(fitting, key=itemgetter(1))
        index = self._free.index(part)
        self._free[index:index + 1] = [(offset + size, free - size)] * (free > size)
        return offset


class _Retired(NamedTuple):
    state: int
    since: float
    offset: int
    size: int


class Memory:
    """
    A new file with a header, which appears at its path when ``appear`` is called.

    It is not thread-safe.

    :ivar words: of the header, as integers.
    :ivar state: the number of the newest state.
    :ivar size: of the file, bytes.
    :cvar keep_s: how long memory is kept that may still be read, seconds.
    :ivar memory: of the file; parts of it stay valid when the file grows, which replaces it.
    """

    keep_s = 0.1

    def __init__(self, path: Path, mode: int = 0o600) -> None:
        """
        Make the file.

        :raises SharedTreeException: the file cannot be made.
        """
        self._path = path
        self._room = Room()
        self._retired: deque[_Retired] = deque()
        self._retired_bytes = 0
        self.state = 0
        self.size = 0
        # Of a writer that was killed: readers are not to take it for this one.
        for left in (path, *path.parent.glob(f'.{path.name}.*')):
            left.unlink(missing_ok=True)
        self._unfinished = path.with_name(f'.{path.name}.{secrets.token_hex(8)}')
        self._file = opened(self._unfinished, os.O_RDWR | os.O_CREAT | os.O_EXCL, mode)
        try:
            os.fchmod(self._file, mode)  # whatever the mask of the process is
            self._grow(PAGE)
        except BaseException:
            self.forget()
            raise
        self._room.take(PAGE)
        self.words = self.view(0, PAGE).cast('q')
        process = process_status(os.getpid())
        self.words[PID], self.words[BEGUN] = os.getpid(), process.begun
        self.words[0] = MAGIC

    def appear(self) -> None:
        """Put the file into its place, where readers find it."""
        self._unfinished.rename(self._path)

    def close(self, why: str) -> None:
        """
        Mark the tree as ended, for those that read it, and remove the file.

        :param why: the reason as a clause.
        """
        text = why.encode()[:PAGE - WHY_AT]
        self.view(WHY_AT, len(text))[:] = text
        fence()
        self.words[WHY] = len(text)
        self.words[BEAT] = 0
        self.words[STATE] = -1  # so that all look
        if self.is_in_place():
            self._path.unlink()
        self.forget()

    def is_in_place(self) -> bool:
        """Return whether readers find this file."""
        with suppress(FileNotFoundError):
            return os.path.samestat(os.stat(self._path), os.fstat(self._file))
        return False

    def forget(self) -> None:
        """Close the file, as a child process does that is not the writer."""
        self._unfinished.unlink(missing_ok=True)  # if it never appeared
        os.close(self._file)
        self._file = -1  # the number may soon be that of another file

    def view(self, offset: int, size: int) -> memoryview:
        """Return a part of the memory."""
        return self.memory[offset:offset + size]

    def allocate(self, size: int) -> int:
        """
        Return the offset of unused memory.

        :raises SharedTreeException: there is none.
        """
        size = _whole(size)
        while (offset := self._room.take(size)) is None:
            # The newest state still refers to what was retired since.
            usable = bool(self._retired) and self._retired[0].state <= self.state
            if not usable or not self._is_old_enough(self._retired[0]):
                try:
                    self._grow(size)
                    continue
                except SharedTreeException:
                    if not usable:
                        raise
            self._use_again()
        return offset

    def _is_old_enough(self, retired: _Retired) -> bool:
        return (time.monotonic() - retired.since >= self.keep_s
                or self._retired_bytes > max(_RETIRED, self.size // 2))

    def retire(self, offset: int, size: int) -> None:
        """Let memory be used again some time after the next state, which does not refer to it."""
        size = _whole(size)
        self._retired.append(_Retired(self.state + 1, time.monotonic(), offset, size))
        self._retired_bytes += size

    def _use_again(self) -> None:
        """Free the memory that was retired first."""
        state, _, offset, size = self._retired.popleft()
        self._retired_bytes -= size
        self.words[INTACT] = state
        fence()
        self._room.add(offset, size)

    def _grow(self, size: int) -> None:
        more = max(size, _LEAST_GROWTH, int(self.size * _GROWTH))
        more += -more % PAGE
        # Otherwise a full file system would kill the process at the first store (SIGBUS).
        try:
            os.posix_fallocate(self._file, self.size, more)
            memory = mmap.mmap(self._file, self.size + more)
        except OSError as error:
            raise SharedTreeException(
                f'there is no memory left ({error.strerror}): the tree needs more than '
                f'{self.size / 1e6:.0f} MB in {SHARED_MEMORY}, so make that larger '
                '(docker run --shm-size=...) or the cache time shorter') from error
        self._room.add(self.size, more)
        self.size += more
        self.memory = memoryview(memory)


def _whole(size: int) -> int:
    return size + -size % _UNIT


assert PAGE % WORD == 0
