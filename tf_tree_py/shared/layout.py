# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What is where in the shared file, and in which order it is written and read.

- The header is one page: a few words, then where the records are.
- A record is one state: a root, which names a directory, and then a row of four words for each
  edge: see ``ROW_WORDS``. The state number ``n`` is the record ``n % RECORDS``.
- A directory has the names, the parents and the static poses, as JSON: see ``directory``.
- A block has the samples of one edge: all stamps, all poses, and perhaps a code for each parent.

The writer appends samples behind those that a record counts, or writes another block, record or
directory; then it stores the number of the new state. So nothing that belongs to a state changes
while it is read, apart from memory that is used again. Before the writer does that, it stores the
number of the oldest state that is still intact.

The order of the stores and loads:

- x86_64: a processor stores in the order of the program, and loads likewise, so ``fence`` does
  nothing.
- aarch64: it may change both orders. To release a lock, and then acquire one, keeps everything
  before it apart from everything after it: the release is a store with release semantics, the
  acquisition a load with acquire semantics, and these two stay in order ("Barrier-ordered-before",
  Arm Architecture Reference Manual, B2.3).

An aligned word is stored and loaded as a whole: ``memoryview`` copies its eight bytes at once.
"""

import platform
import struct
import sys
from typing import NamedTuple

from tf_tree_py.core import fork_locks

from .errors import SharedTreeException

MAGIC = int.from_bytes(b'tf_tree3', 'little')
WORD = 8
PAGE = 4096

# How many states a reader may be behind before what it copies is overwritten.
RECORDS = 8
POSE_BYTES = 56
_CODE_BYTES = 4


# The words of the header, by their index; zero is the magic number.
#
# The process that writes: its number, and when it began (see ``place.process_status``).
PID, BEGUN = 1, 2
# Its last sign of life, nanoseconds of the monotonic clock; zero if it has ended.
BEAT = 3
# The newest state (see ``state_word``), and the number of the oldest whose blocks and directory
# are intact.
STATE, INTACT = 4, 5
# The length of the text at ``WHY_AT``: why the writer ended.
WHY = 6
# The number of the last state that is more than the one before it with new samples; see ``Root``.
CHANGED = 7

_RECORDS_AT = 64  # the first of the words that say where the records are
WHY_AT = 2048


def state_word(state: int) -> int:
    """Return the number of a state with check bits, because a lower number is a state, too."""
    return state << 16 | state * 40503 & 0xffff


class Root(NamedTuple):
    """
    The words at the beginning of a record.

    :ivar checksum: of all words behind it, with those of the rows.
    :ivar state: its number.
    :ivar directory: the offset of its directory, bytes.
    :ivar directory_bytes: its length.
    :ivar directory_sum: its checksum.
    :ivar edition: the number of the directory: another one has another number.
    :ivar changed: the number of the last state that is more than the one before it with new
        samples: no sample is older than the newest of its edge was, and none at ``steady`` or
        later has expired.
    :ivar steady: that stamp, nanoseconds; it is the same in all states until the next change.
    """

    checksum: int
    state: int
    directory: int
    directory_bytes: int
    directory_sum: int
    edition: int
    changed: int
    steady: int


ROOT_WORDS = len(Root._fields)
ROOT_BYTES = WORD * ROOT_WORDS
_root_struct = struct.Struct(f'{ROOT_WORDS}q')
write_root = _root_struct.pack_into


def root_of(record: bytes) -> Root:
    """Return the root of a record, which may be too short."""
    return Root._make(_root_struct.unpack(record[:ROOT_BYTES].ljust(ROOT_BYTES, b'\0')))


def place_of_record(state: int) -> int:
    """Return which word of the header is the offset of a record; the next one is its length."""
    return _RECORDS_AT + 2 * (state % RECORDS)


# The words of a row, which are zero for a static edge, apart from the last:
#
# 0: the offset of the block of the edge, bytes.
# 1: how many samples the block has room for; above these 32 bits, the number of the block, because
#    another one may be at the same offset later.
# 2: twice the number of samples; plus one if samples have expired that are older than the window
#    of the newest. Otherwise those have that are older than the window of the one before it, which
#    is usual: see ``PackedSamples.insert``.
# 3: the index of the last publisher among the names of the directory.
ROW_WORDS = 4
row_struct = struct.Struct(f'{ROW_WORDS}q')


def row_at(index: int) -> int:
    """Return where a row is in a record, bytes; that of their number is the size of the record."""
    return ROOT_BYTES + row_struct.size * index


class Block(NamedTuple):
    """
    Memory for the samples of one edge.

    :ivar number: of the block, among all that its writer ever made.
    :ivar poses: as bytes.
    :ivar codes: of the parents; empty if all samples have the same parent.
    """

    number: int
    offset: int
    capacity: int
    stamps: 'memoryview[int]'
    poses: 'memoryview[int]'
    codes: 'memoryview[int]'

    @property
    def size(self) -> int:
        """Return the number and the capacity in one word; see ``ROW_WORDS``."""
        return (self.number & 0x7fffffff) << 32 | self.capacity


def block_bytes(capacity: int, coded: bool) -> int:
    """Return the size of a block."""
    return capacity * (WORD + POSE_BYTES + (_CODE_BYTES if coded else 0))


def block_at(memory: memoryview, offset: int, capacity: int, coded: bool,
             number: int = 0) -> Block:
    """Return a block of a file."""
    poses = offset + WORD * capacity
    codes = poses + POSE_BYTES * capacity
    end = codes + (_CODE_BYTES * capacity if coded else 0)
    return Block(number, offset, capacity, memory[offset:poses].cast('q'), memory[poses:codes],
                 memory[codes:end].cast('I') if coded else memory[:0])


# --- order

_lock = fork_locks.lock()


def _fence() -> None:
    """Keep all stores and loads before this call apart from those after it."""
    with _lock:
        pass
    with _lock:
        pass


def _no_fence() -> None:
    """Do nothing: the processor keeps the order."""


ORDERED = platform.machine() in ('x86_64', 'AMD64')
"""Whether the processor keeps the order, so that ``fence`` does nothing."""
fence = _no_fence if ORDERED else _fence


def check_platform() -> None:
    """
    Refuse platforms on which the order is unknown.

    :raises SharedTreeException: with the reason.
    """
    if not sys.platform.startswith('linux'):
        raise SharedTreeException('A tree can be shared on Linux only')
    if platform.machine() not in ('x86_64', 'AMD64', 'aarch64') or sys.byteorder != 'little':
        raise SharedTreeException(
            f'A tree cannot be shared on {platform.machine()}: the order of its stores is known '
            'for x86_64 and aarch64 only')
