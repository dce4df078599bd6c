# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A reader's access to the file of a writer, and the signs of the writer's life.

The file is mapped for reading only. Whether the writer lives is asked of the system (see
``place``), not of the file; but a writer that is stopped lives, so it must also give a sign of
life now and then.
"""

from contextlib import suppress
import mmap
import os
import time
import weakref

from tf_tree_py.core.stamp import format_span
from tf_tree_py.core.text import listed

from .errors import SharedTreeException
from .layout import BEAT, BEGUN, MAGIC, PAGE, PID, WHY, WHY_AT
from .place import is_held, opened, other_users, Place, process_status

_HOW_TO_START = 'start one with: ros2 run tf_tree_py tf_share'
# The writer gives ten signs of life a second. After this time without one, nanoseconds, the system
# is asked whether it lives, and runs.
_SILENCE = 250_000_000
# A writer that runs may be this late: where more programs run than the machine has processors, and
# where another thread of it computes.
_TOO_LONG = 2_000_000_000


class Attachment:
    """
    The file of a writer, mapped.

    :ivar words: of the header; see ``layout``.
    :ivar memory: the whole file.
    :ivar alive_until: until when the writer need not be looked for, nanoseconds of the monotonic
        clock.
    """

    def __init__(self, place: Place) -> None:
        """
        Map the file of the present writer.

        :raises SharedTreeException: there is none, or its file cannot be read.
        """
        self._place = place
        self.words, self.memory = memoryview(bytes(PAGE)).cast('q'), memoryview(b'')
        self._file, self.alive_until = -1, 0
        place.check_folder()
        try:
            self._lock = opened(place.lock, os.O_RDONLY)
        except FileNotFoundError:
            raise self._nobody() from None
        self._free_lock = weakref.finalize(self, os.close, self._lock)
        self._free_file: weakref.finalize[..., Attachment] | None = None
        if not self._map_newest():
            raise self._nobody()
        # In this order: a writer that begins in between is not to be taken for a dead one.
        if not is_held(self._lock):
            raise self._silent(False, False, time.monotonic_ns() - self.words[BEAT])

    def close(self) -> None:
        """Free the file; later calls of ``check`` raise an error."""
        if self._free_file is not None:
            self._free_file()
        self._free_lock()
        self.words, self.memory = memoryview(bytes(PAGE)).cast('q'), memoryview(b'')

    def check(self) -> None:
        """
        Find out whether the writer is there, if it has given no sign of life for long.

        If there is another writer, its file is mapped. There is no need to ask again before
        ``alive_until``.

        :raises SharedTreeException: there is no writer.
        """
        now, beat = time.monotonic_ns(), self.words[BEAT]
        self.alive_until = min(beat, now) + _SILENCE
        if 0 <= now - beat < _SILENCE:
            return
        if not self._free_lock.alive:
            raise SharedTreeException('This shared tree has been closed')
        held = self._is_held()
        if held and self._map_newest():
            return
        # A writer removes the file of the one before it, so this one is that of the holder.
        held = held and self._is_in_place()
        stopped = process_status(self.words[PID]) == (True, self.words[BEGUN])
        if not held or stopped or not beat or now - beat >= _TOO_LONG:
            raise self._silent(held, stopped, now - beat)

    def _is_held(self) -> bool:
        """Return whether there is a writer; its lock may be another file than before."""
        if is_held(self._lock):
            return True
        with suppress(FileNotFoundError):
            found = opened(self._place.lock, os.O_RDONLY)
            if not os.path.samestat(os.fstat(found), os.fstat(self._lock)):
                self._free_lock()
                self._lock, self._free_lock = found, weakref.finalize(self, os.close, found)
                return is_held(found)
            os.close(found)
        return False

    def _is_in_place(self) -> bool:
        with suppress(FileNotFoundError):
            return os.path.samestat(os.stat(self._place.memory), os.fstat(self._file))
        return False

    @property
    def who(self) -> str:
        """Return which process the writer is, for texts."""
        return f'tf_share (process {self.words[PID]}, {self._place.what})'

    def size(self) -> int:
        """Return the size of the file, bytes."""
        return os.fstat(self._file).st_size

    def holds(self, offset: int, size: int) -> bool:
        """Return whether a part is inside of the file, and map what the file has grown by."""
        if offset < 0 or size < 0 or self._file < 0:
            return False
        if offset + size > len(self.memory):
            now = self.size()
            if now > len(self.memory):
                self.memory = self._mapped(self._file, now)
        return offset + size <= len(self.memory)

    def _map_newest(self) -> bool:
        """Map the file at the place; return whether it is there, and not mapped yet."""
        try:
            descriptor = opened(self._place.memory, os.O_RDONLY)
        except FileNotFoundError:
            return False
        found = os.fstat(descriptor)
        try:
            if self._free_file is not None and os.path.samestat(found, os.fstat(self._file)):
                os.close(descriptor)
                return False
            if found.st_size < PAGE:
                raise self.damaged('it is too short')
            memory = self._mapped(descriptor, found.st_size)
            words = memory[:PAGE].cast('q')
            if words[0] != MAGIC:
                raise self.damaged('it is not a tree of this version of tf_tree_py')
        except SharedTreeException:
            os.close(descriptor)
            raise
        if self._free_file is not None:
            self._free_file()
        self._file, self.memory, self.words = descriptor, memory, words
        self._free_file = weakref.finalize(self, os.close, descriptor)
        self.alive_until = 0
        return True

    def _mapped(self, descriptor: int, size: int) -> memoryview:
        try:
            return memoryview(mmap.mmap(descriptor, size, prot=mmap.PROT_READ))
        except OSError as error:
            raise self.damaged(str(error.strerror)) from error

    # --- errors

    def damaged(self, why: str) -> SharedTreeException:
        """Return the error of a file that cannot be read."""
        return SharedTreeException(
            f'{self._place.memory} cannot be read: {why}. Restart the process that shares '
            f'{self._place.what}')

    def _nobody(self) -> SharedTreeException:
        others = other_users()
        beside = f' (users with trees of their own: {listed(others)})' if others else ''
        return SharedTreeException(
            f'No process shares {self._place.what}{beside}: {_HOW_TO_START}')

    def _silent(self, held: bool, stopped: bool, silence: int) -> SharedTreeException:
        words = self.words
        who = f'The process {words[PID]}, which shared {self._place.what},'
        length = words[WHY]
        if 0 < length <= PAGE - WHY_AT:
            why = bytes(self.memory[WHY_AT:WHY_AT + length]).decode(errors='replace')
            return SharedTreeException(f'{who} has ended: {why}. To look up, {_HOW_TO_START}')
        last = f'its last sign of life was {format_span(silence)} ago'
        if stopped:
            return SharedTreeException(
                f'{who} has been stopped by a signal (SIGSTOP, Ctrl-Z) or a debugger: {last}. '
                f'Let it go on with: kill -CONT {words[PID]}')
        if held:
            return SharedTreeException(
                f'{who} lives, but does not run: {last}. It hangs, or the machine is overloaded')
        return SharedTreeException(f'{who} has died: {last}. To look up, {_HOW_TO_START}')
