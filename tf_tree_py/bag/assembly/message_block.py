# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Many messages with the same names are read together, as one numpy array of their bytes."""

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.edges.packed import POSE_FLOATS
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.message_layout import MessageLayout
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps

# struct's letters for numbers, as numpy writes them.
_TYPES = {'i': 'i4', 'I': 'u4'}

# Bytes of messages that are read at a time; they fit into the cache of any processor.
_CACHED_BYTES = 500_000

Bools = npt.NDArray[np.bool_]


class MessageBlock:
    """Reads messages of one size, and finds those that contain the names of a layout."""

    def __init__(self, layout: MessageLayout) -> None:
        places, size = layout.wanted, layout.key[0]
        self._fixed = np.concatenate([np.arange(part.start, part.stop) for part in layout.fixed])
        self._names = np.frombuffer(b''.join(layout.names), dtype=np.uint8)
        # A stamp consists of two adjacent numbers of four bytes.
        self._stamps = np.concatenate(
            [np.arange(place.stamp, place.stamp + 8) for place in places] or [self._fixed[:0]])
        self._stamp = np.dtype([(name, layout.order + _TYPES[letter]) for name, letter
                                in zip(('sec', 'nanosec'), layout.stamp, strict=True)])
        pose = np.dtype((f'{layout.order}f8', POSE_FLOATS))
        self._type = np.dtype({
            'names': ['bytes', *(f'pose{number}' for number in range(len(places)))],
            'formats': [np.dtype((np.uint8, size)), *(pose for _ in places)],
            'offsets': [0, *(place.pose for place in places)], 'itemsize': size})
        self._count = len(places)

    def read(self, messages: Sequence[bytes]) -> tuple[Bools, Stamps, Array]:
        """
        Return which messages contain the names and possible stamps, and their samples.

        :param messages: n messages, all of the same size.
        :return: (n,) booleans, and for the k wanted transforms in the m messages of these
            the stamps (k, m) and the poses (k, m, 7), not checked yet.
        """
        count = len(messages)
        fits = np.empty(count, dtype=np.bool_)
        stamps = np.empty((self._count, count), dtype=np.int64)
        poses = np.empty((self._count, count, POSE_FLOATS))
        step = max(_CACHED_BYTES // self._type.itemsize, 1)
        for begin in range(0, count, step):
            some = slice(begin, begin + step)
            rows = np.frombuffer(b''.join(messages[some]), dtype=self._type)
            fits[some] = (rows['bytes'].take(self._fixed, axis=1) == self._names).all(axis=1)
            pairs = rows['bytes'].take(self._stamps, axis=1).view(self._stamp).T
            fits[some] &= (pairs['nanosec'] < NANOSECONDS_PER_SECOND).all(axis=0)
            np.multiply(pairs['sec'], NANOSECONDS_PER_SECOND, out=stamps[:, some], dtype=np.int64)
            stamps[:, some] += pairs['nanosec']
            for number in range(self._count):
                poses[number, some] = rows[f'pose{number}']
        if fits.all():
            return fits, stamps, poses
        return fits, stamps[:, fits], poses[:, fits]


_blocks: WeakKeyDictionary[MessageLayout, MessageBlock] = WeakKeyDictionary()


def block_of(layout: MessageLayout) -> MessageBlock:
    """Return the block of a layout, which is made once, and lives as long as the layout."""
    block = _blocks.get(layout)
    if block is None:
        block = _blocks[layout] = MessageBlock(layout)
    return block
