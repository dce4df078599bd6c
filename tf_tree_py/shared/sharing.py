# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The writer of a shared tree.

Whoever changes a tree holds its lock, so each hold of the lock ends with a new state, if anything
has changed: a message becomes visible as a whole.
"""

from array import array
import os
import threading
import time
from types import TracebackType
from typing import NamedTuple
import zlib

from tf_tree_py.core import fork_locks
from tf_tree_py.core.buffer.plain_buffer import PlainBuffer
from tf_tree_py.core.buffer.waiting import Waiting
from tf_tree_py.core.closable import Closable
from tf_tree_py.core.edges.protocol import History
from tf_tree_py.core.stamp import BEGINNING, UNLIMITED
from tf_tree_py.core.tree.tree import Tree

from . import layout
from .block_samples import BlockSamples
from .directory import directory_of, Failures, Reception
from .errors import SharedTreeException
from .futex import Futex
from .layout import (
    CHANGED,
    fence,
    place_of_record,
    RECORDS,
    ROOT_BYTES,
    ROOT_WORDS,
    ROW_WORDS,
    STATE,
    WORD,
)
from .memory import Memory
from .place import hold, Place

CLOSED = 'it was stopped, and closed the tree'
_BEAT_S = 0.1
# The steady stamp (see ``layout.Root``) is renewed after this part of the window.
_STEADY_PARTS = 8


class SharingTree(Tree):
    """A tree whose samples can lie in shared memory."""

    samples = BlockSamples


def share(buffer: PlainBuffer, place: Place, reception: Reception | None = None) -> 'Sharing':
    """
    Share the tree of a buffer, from now until the end of the process or ``close``.

    :param buffer: its ``tree_class`` is ``SharingTree``, and no other thread uses it yet.
    :param reception: how it receives its transforms, for readers that need to know.
    :raises SharedTreeException: somebody else shares a tree at this place, or it cannot be shared.
    """
    if buffer.cache_time >= UNLIMITED:
        raise SharedTreeException(
            'A shared tree needs a cache time, because the memory of the machine is limited')
    sharing = Sharing(place, buffer._tree, buffer.waiting, reception or {})
    buffer._lock = buffer.waiting.lock = buffer.intake.lock = sharing.lock
    return sharing


class PublishingLock:
    """A buffer's lock, at whose release a new state is published."""

    def __init__(self, sharing: 'Sharing') -> None:
        self._lock = fork_locks.rlock()
        self._sharing = sharing
        self._depth = 0

    def __enter__(self) -> None:
        self._lock.acquire()
        self._depth += 1

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._depth -= 1
        try:
            if self._depth == 0:
                self._sharing.publish()
        finally:
            self._lock.release()


class _Slot(NamedTuple):
    """The memory of every eighth record."""

    offset: int
    memory: memoryview


class Sharing(Closable):
    """
    A tree in shared memory, for the process that changes it; see ``share``.

    :ivar lock: the tree is changed, and looked up in this process, only with this lock.
    :ivar reception: how the transforms are received; ``describe`` replaces it.
    :ivar over: set when sharing has ended.
    :ivar why: the reason as a clause, then.
    """

    def __init__(self, place: Place, tree: Tree, waiting: Waiting, reception: Reception) -> None:
        self.lock = PublishingLock(self)
        self.reception = reception
        self._waiting = waiting
        self._tree = tree
        self._histories: list[History] = []
        self._moving: list[BlockSamples] = []
        self._authorities: list[str] = []
        self._names: dict[str, int] = {}
        # What the newest state contains.
        self._version, self._written_names, self._all_have_blocks = -1, 0, True
        self._failure, self._failures = waiting.failure, Failures()
        self._slots: list[_Slot] = []
        self._slot_bytes = 0
        # The next record, as words; and as bytes: all, those of its checksum, and its rows.
        self._record = memoryview(array('q'))
        self._bytes = self._summed = self._rows = memoryview(b'')
        # Whether the next state is more than the newest one with new samples.
        self._is_news, self._written_rows = True, b''
        self._changed, self._steady = 0, BEGINNING
        # The directory; and its offset, length and checksum.
        self._directory, self._edition = b'', 0
        self._directory_facts = 0, 0, 0
        self._blocks = 0
        self.over, self.why = threading.Event(), ''
        place.make_folder()
        self._held = hold(place)
        try:
            self._memory = Memory(place.memory)
        except BaseException:
            os.close(self._held)
            raise
        self._futex = Futex(self._memory.words, STATE)
        fork_locks.repair(self)
        self.publish()
        if self.over.is_set():
            raise SharedTreeException(self.why)
        self._memory.words[layout.BEAT] = time.monotonic_ns()
        self._memory.appear()
        self._heart = threading.Thread(target=self._beat, name='tf_tree_py shares', daemon=True)
        self._heart.start()

    def describe(self, reception: Reception) -> None:
        """Replace the description of how the transforms are received."""
        with self.lock:
            self.reception, self._version = reception, -1

    def close(self, why: str = CLOSED) -> None:
        """
        End sharing; readers then get an error, and the tree goes on in memory of this process.

        :param why: the reason as a clause.
        """
        with self.lock:
            self._end(why)
        self._heart.join()

    def _end(self, why: str) -> None:
        if not self.over.is_set():
            self._leave(why)
            self._memory.close(why)
            self._futex.wake_all()
            os.close(self._held)

    def repair_in_child(self) -> None:
        """Leave the memory to the parent process, which remains the writer."""
        if not self.over.is_set():
            self._leave('this is a child process of the one that shares it')
            self._memory.forget()
            os.close(self._held)

    def _leave(self, why: str) -> None:
        self.why = why
        self.over.set()
        for history in self._moving:
            history.leave()

    def _beat(self) -> None:
        while not self.over.wait(_BEAT_S):
            with self.lock:  # or else it might beat once more after the end
                if self.over.is_set():
                    break
                self._memory.words[layout.BEAT] = time.monotonic_ns()
                if not self._memory.is_in_place():
                    self._end('its file was removed')

    # --- a new state

    def publish(self) -> None:
        """
        Make the present state of the tree visible, if it is new; the lock is held.

        If that is impossible, sharing ends.
        """
        if self.over.is_set():
            return
        try:
            self._renew_rows()
            rows = self._rows.tobytes()
            if not self.over.is_set() and (self._is_news or rows != self._written_rows):
                self._write_state()
                self._written_rows, self._is_news = rows, False
        except Exception as error:  # noqa: B902 - half a state must not be completed
            self._end(f'{error}' or repr(error))

    def _write_state(self) -> None:
        memory, words = self._memory, self._memory.words
        state = memory.state + 1
        if self._is_news or self._expired() > self._steady:
            self._changed = state
            self._steady = self._expired() + self._tree.cache_time // _STEADY_PARTS
        # At the offset 0; and 0 in place of the checksum, which follows.
        layout.write_root(self._bytes, 0, 0, state, *self._directory_facts, self._edition,
                          self._changed, self._steady)
        self._record[0] = zlib.crc32(self._summed)
        slot, size, place = self._slots[state % RECORDS], len(self._bytes), place_of_record(state)
        slot.memory[:size] = self._bytes
        words[place], words[place + 1] = slot.offset, size
        words[CHANGED] = self._changed
        fence()
        memory.state = state
        words[STATE] = layout.state_word(state)
        self._futex.wake_all()

    def _expired(self) -> int:
        """Return the first stamp for which no sample of any edge has expired."""
        newest = max((history.newest_stamp for history in self._moving
                      if history.newest_stamp is not None), default=BEGINNING)
        return max(newest - self._tree.cache_time, BEGINNING)

    def _renew_rows(self) -> None:
        """
        Bring the rows, and what else belongs to a state, up to date.

        A keyboard interrupt may end it at any call; then the next one does what is left.
        """
        tree = self._tree
        structure = tree.version != self._version
        if structure:
            self._assign_rows(list(tree.histories.values()))
        authorities = [history.authority for history in self._histories]
        if structure or authorities != self._authorities:
            self._record[ROOT_WORDS + 3::ROW_WORDS] = array('q', map(self.code, authorities))
            self._authorities = authorities
        failure = self._waiting.failure
        if (not structure and self._all_have_blocks and failure is self._failure
                and self._written_names == len(self._names)):
            return
        self._is_news = True
        if failure is not self._failure:
            self._failures = Failures(self._failures.number + 1, str(failure))
            self._failure = failure
        for history in self._moving:
            if history.block is None:
                history.settle()
                if self.over.is_set():  # there is no memory
                    return
        self._write_directory()
        self._version, self._all_have_blocks = tree.version, True
        self._written_names = len(self._names)

    def _assign_rows(self, histories: list[History]) -> None:
        """Give each edge a row, and take the blocks of those that are gone."""
        for history in set(self._histories) - set(histories):
            if isinstance(history, BlockSamples):
                history.release()
        self._histories = histories
        self._moving = [history for history in histories if isinstance(history, BlockSamples)]
        record = array('q', bytes(layout.row_at(len(histories))))
        for index, history in enumerate(histories):
            if isinstance(history, BlockSamples):
                history.place_in(self)
                history.use_row(record, index)
        self._use_record(record)

    def _use_record(self, record: 'array[int]') -> None:
        """Write this record from now on."""
        self._record, self._written_rows = memoryview(record), b''
        self._bytes = self._record.cast('B')
        self._summed = self._bytes[WORD:]
        self._rows = self._bytes[ROOT_BYTES:]
        if len(self._bytes) > self._slot_bytes:
            self._make_slots(2 * len(self._bytes))

    def _make_slots(self, size: int) -> None:
        offsets = [self._memory.allocate(size) for _ in range(RECORDS)]
        before = self._slots
        self._slots = [_Slot(offset, self._memory.view(offset, size)) for offset in offsets]
        self._slot_bytes = size
        for slot in before:
            self._memory.retire(slot.offset, len(slot.memory))

    def _write_directory(self) -> None:
        """Write the directory if it has changed."""
        directory = directory_of(
            self._tree, list(self._names), self._failures, self.reception).as_bytes()
        if directory == self._directory:
            return
        memory, size = self._memory, len(directory)
        offset = memory.allocate(size)
        memory.view(offset, size)[:] = directory
        before = self._directory_facts
        self._directory_facts = offset, size, zlib.crc32(directory)
        self._edition += 1
        self._directory = directory
        if before[1]:
            memory.retire(*before[:2])

    # --- blocks

    def new_block(self, capacity: int, coded: bool) -> layout.Block | None:
        """Return an unused block; None if there is no memory, so that sharing has ended."""
        try:
            offset = self._memory.allocate(layout.block_bytes(capacity, coded))
        except SharedTreeException as error:
            self._end(str(error))
            return None
        self._blocks += 1
        return layout.block_at(self._memory.memory, offset, capacity, coded, self._blocks)

    def retire_block(self, block: layout.Block) -> None:
        """Let a block be used again, some time after the next state."""
        self._memory.retire(block.offset, layout.block_bytes(block.capacity, len(block.codes) > 0))

    def code(self, name: str) -> int:
        """Return the number of a name."""
        return self._names.setdefault(name, len(self._names))

    def note(self) -> None:
        """Take note that a history has no block."""
        self._all_have_blocks = False
