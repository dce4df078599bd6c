# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The samples of an edge in shared memory, as their writer sees them.

The rules are those of ``Samples``. A sample behind the last is written into the block in place,
where no reader looks yet. For any other change the samples are first copied to memory of this
process (``thaw``), and before the next state to a new block (``settle``).
"""

from array import array
from typing import Protocol

from tf_tree_py.core.edges.interpolation import Interpolation, LINEAR
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import BEGINNING
from tf_tree_py.core.times import Stamps

from .layout import Block, POSE_BYTES, row_at, ROW_WORDS, WORD

# How many more samples than it has now a block has room for, at least.
_SPARE = 32
# The samples of such a part of the window show the rate of an edge; and a block has room for one
# more such part than the window has.
_PARTS = 12
# The multiples of the golden ratio are spread evenly, however many there are.
_GOLDEN = 0.618034
_NO_MEMORY = memoryview(b'')


class Blocks(Protocol):
    """Where blocks come from; see ``Sharing``."""

    def new_block(self, capacity: int, coded: bool) -> Block | None:
        """Return an unused block; None if there is no memory, and all histories were thawed."""

    def retire_block(self, block: Block) -> None:
        """Let a block be used again, some time after the next state."""

    def code(self, name: str) -> int:
        """Return the number of a name."""

    def note(self) -> None:
        """Take note that a history has no block, so that it gets one before the next state."""


class BlockSamples(Samples):
    """
    Samples in a block, or, between a change and the next state, in memory of this process.

    :ivar block: where they are; None if they are in memory of this process, or there are none.
    """

    __slots__ = ('_blocks', 'block', '_first', '_count', '_own_stamps', '_own_poses', '_record',
                 '_at', '_at_samples', '_at_authority', '_room', '_in_stamps', '_in_poses')

    def __init__(self, child: str, cache_time: int, authority: str = '',
                 interpolation: Interpolation = LINEAR) -> None:
        self._blocks: Blocks | None = None
        self.block: Block | None = None
        # The samples are those from the first to the count in the block; those before are expired.
        self._first = self._count = 0
        self._record = array('q')
        self._at, self._at_samples, self._at_authority = 0, 2, 3
        self._in_stamps = self._in_poses = _NO_MEMORY
        super().__init__(child, cache_time, authority, interpolation)

    @property
    def coded(self) -> bool:
        """Return whether each sample has a parent of its own."""
        return self.parents is not None

    def stored_ends(self) -> list[int]:
        """Return the stamps of the samples at which the edge ended."""
        return sorted(self._ends)

    def place_in(self, blocks: Blocks) -> None:
        """Use blocks, from the next call of ``settle`` on."""
        if self._blocks is None:
            self._blocks = blocks
            blocks.note()

    def use_row(self, record: 'array[int]', index: int) -> None:
        """Write the row with this index from now on."""
        self._record, self._at = record, row_at(index) // WORD
        self._at_samples, self._at_authority = self._at + 2, self._at + 3
        self._write_row()

    # --- memory

    @property  # type: ignore[override]
    def stamps(self) -> 'array[int] | memoryview[int]':
        """Return the stamps of all samples in memory."""
        block = self.block
        return self._own_stamps if block is None else block.stamps[self._first:self._count]

    @stamps.setter
    def stamps(self, stamps: 'array[int]') -> None:
        self._own_stamps = stamps

    @property  # type: ignore[override]
    def poses(self) -> 'array[float] | memoryview[float]':
        """Return their poses."""
        block = self.block
        return self._own_poses if block is None else block.poses[
            POSE_BYTES * self._first:POSE_BYTES * self._count].cast('d')

    @poses.setter
    def poses(self, poses: 'array[float]') -> None:
        self._own_poses = poses

    def thaw(self) -> None:
        """Copy the samples to memory of this process, where anything can be changed."""
        if self.block is not None:
            self._own_stamps = array('q', self.stamps.tobytes())
            self._own_poses = array('d', self.poses.tobytes())
            self.release()

    def leave(self) -> None:
        """Use no blocks any more."""
        self.thaw()
        self._blocks, self._in_stamps, self._in_poses = None, _NO_MEMORY, _NO_MEMORY

    def release(self) -> None:
        """Give up the block, and its samples."""
        if self.block is not None:
            assert self._blocks is not None
            self._blocks.note()
            block, self.block = self.block, None  # an interrupt must not let it be retired twice
            self._blocks.retire_block(block)

    def settle(self) -> bool:
        """
        Copy the samples to a new block, with room for more.

        :return: whether they are in a block now: not if there are none, or there is no memory.
        """
        assert self._blocks is not None
        if not self.coded:  # or else expired samples decide when the others lose their codes
            self._drop(self.first())
        stamps, poses, count = self.stamps, self.poses, len(self.stamps)
        if not count:
            return False
        block, old = self._blocks.new_block(self._capacity(), self.coded), self.block
        if block is None:
            return False
        block.stamps[:count] = memoryview(stamps)
        block.poses[:POSE_BYTES * count] = memoryview(poses).cast('B')
        if self.parents is not None:
            block.codes[:count] = memoryview(array('I', map(self._blocks.code, self.parents)))
        room, row = self._room_in(block.capacity), self._row_of(block, count)
        # An interrupt comes at a call: not between these lines.
        self._record[self._at:self._at_authority] = row
        self.block, self._first, self._count, self._room = block, 0, count, room
        self._in_stamps, self._in_poses = block.stamps, block.poses
        if old is not None:
            self._blocks.retire_block(old)
        return True

    def _capacity(self) -> int:
        """
        Return how many samples a new block should have room for.

        Those of a whole window as soon as their rate is known: smaller blocks on the way there
        would leave memory behind that is too small for larger ones.
        """
        count, span = len(self.stamps), self.stamps[-1] - self.stamps[0]
        in_window = count * self.cache_time // span if span else count
        wanted = max(in_window, count) * (_PARTS + 1) // _PARTS
        if span < self.cache_time // _PARTS:
            wanted = min(wanted, count + count // 2)  # perhaps they are a burst
        wanted += _SPARE
        # Few sizes, so that a block fits where another one was.
        grid = 1 << max(wanted.bit_length() - 6, 0)
        return -(-wanted // grid) * grid

    def _room_in(self, capacity: int) -> int:
        """
        Return how many samples a new block is used for.

        Edges with the same rate must not all be copied in the same message, again and again. So
        each is copied at stamps of its own: those that, modulo a part of the window, are a
        certain number.
        """
        count, newest = len(self.stamps), self.stamps[-1]
        span, period = newest - self.stamps[0], self.cache_time // _PARTS
        if not span or not period:
            return capacity
        full = newest + (capacity - count) * span // (count - 1)
        own = int(self._at // ROW_WORDS * _GOLDEN % 1.0 * period)
        ahead = full - (full - own) % period - newest
        return count + max(ahead * (count - 1) // span, 1) if ahead > 0 else capacity

    def _write_row(self) -> None:
        self._record[self._at:self._at_authority] = self._row_of(self.block, self._count)

    def _row_of(self, block: Block | None, count: int) -> 'array[int]':
        """Return the words of a row but the last, which is not written here."""
        if block is None:
            return array('q', (0, 0, 0))
        usual = BEGINNING if count < 2 else block.stamps[count - 2] - self.cache_time
        return array('q', (block.offset, block.size, 2 * count + (self._horizon != usual)))

    # --- the next sample, in place

    def append(self, stamp: int, pose: bytes, coded: bool = False) -> bool:
        """
        Insert the next sample with the same parent; as in ``PackedSamples``, but in place.

        :param coded: whether the caller stores the parent of the sample.
        """
        if self.block is None or self._count == self._room and not self.settle():
            return not coded and super().append(stamp, pose)
        latest = self.newest_stamp
        if latest is None or stamp < latest or (self.parents is not None and not coded):
            return False
        self._horizon = latest - self.cache_time
        count = self._count
        at = POSE_BYTES * count
        self._in_stamps[count] = stamp
        self._in_poses[at:at + POSE_BYTES] = pose
        self._count = count = count + 1
        self._record[self._at_samples] = count + count
        self.newest_stamp = self.latest_stamp = stamp
        return True

    def _append(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        if self.block is None or not self.append(stamp, pack_pose(*pose), self.coded):
            super()._append(stamp, parent, pose)
            return
        self.parent = parent
        if self.parents is not None:
            assert self._blocks is not None
            self.block.codes[self._count - 1] = self._blocks.code(parent)
            self.parents.append(parent)

    def _drop(self, count: int) -> None:
        if self.block is None or self.coded:
            self.thaw()
            super()._drop(count)
        else:
            self._first += count

    # --- any other change

    def insert(self, stamp: int, parent: str, pose: PoseTuple) -> bool:
        """Insert a sample, unless it is older than the window; see ``PackedSamples``."""
        kept = super().insert(stamp, parent, pose)
        if self.block is not None:
            self._write_row()
        return kept

    def extend(self, stamps: Stamps, poses: Array) -> None:
        """Insert many samples; see ``MovingHistory``."""
        self.thaw()
        super().extend(stamps, poses)

    def _insert_between(self, stamp: int, parent: str, pose: PoseTuple) -> None:
        self.thaw()
        super()._insert_between(stamp, parent, pose)

    def _write_parents(self) -> None:
        if not self.coded:
            self.thaw()
        super()._write_parents()

    def _empty(self) -> None:
        self.release()
        super()._empty()

    def copy(self) -> Samples:  # type: ignore[override]
        """Return an independent history, in memory of this process."""
        return owned(self.copied_into(Samples(
            self.child, self.cache_time, self.authority, self.interpolation.copy())))


def owned(samples: Samples) -> Samples:
    """Copy the memory of samples to this process, and return them."""
    samples.stamps = array('q', samples.stamps.tobytes())
    samples.poses = array('d', samples.poses.tobytes())
    samples.parents = None if samples.parents is None else list(samples.parents)
    return samples
