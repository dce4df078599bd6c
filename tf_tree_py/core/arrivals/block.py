"""Many messages with the same names, read together: their bytes are one array for numpy."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..edges.packed import POSE_FLOATS
from ..geometry.so3 import Array
from ..stamp import NANOSECONDS_PER_SECOND
from ..times import Stamps

# struct's letters for numbers, as numpy writes them.
_TYPES = {'i': 'i4', 'I': 'u4'}

Bools = npt.NDArray[np.bool_]


class Place(NamedTuple):
    """Where one transform stands: its stamp, its names with their lengths, its pose."""

    stamp: int
    parent: slice
    child: slice
    pose: int


class Block:
    """Reads messages of one size, and tells which of them have the names that it knows."""

    def __init__(self, size: int, fixed: Iterable[slice], names: bytes,
                 places: Sequence[Place], order: str, stamp: str) -> None:
        """
        Prepare to read.

        :param size: of a message, bytes.
        :param fixed: what all messages share: the head and the names.
        :param names: what stands there.
        :param places: of the transforms that are wanted.
        :param order: struct's letter for the byte order.
        :param stamp: struct's format of a stamp.
        """
        self._fixed = np.concatenate([np.arange(part.start, part.stop) for part in fixed])
        self._names = np.frombuffer(names, dtype=np.uint8)
        sec, nanosec = (np.dtype(order + _TYPES[letter]) for letter in stamp)
        pose = np.dtype((f'{order}f8', POSE_FLOATS))
        fields = [('bytes', np.dtype((np.uint8, size)), 0)]
        for number, place in enumerate(places):
            fields += [(f'sec{number}', sec, place.stamp),
                       (f'nanosec{number}', nanosec, place.stamp + sec.itemsize),
                       (f'pose{number}', pose, place.pose)]
        names_of, types, offsets = zip(*fields, strict=True)
        self._type = np.dtype({'names': names_of, 'formats': types, 'offsets': offsets,
                               'itemsize': size})
        self._count = len(places)

    def read(self, data: bytes) -> tuple[Bools, list[tuple[Stamps, Array]]]:
        """
        Return which messages have the names, and the samples of those.

        :param data: n messages, one behind the other.
        :return: (n,) booleans; of each transform that is wanted the stamps (m,) and the poses
            (m, 7), not checked yet.
        """
        rows = np.frombuffer(data, dtype=self._type)
        fits = (rows['bytes'].take(self._fixed, axis=1) == self._names).all(axis=1)
        if not fits.all():
            rows = rows[fits]
        return fits, [(self._stamps(rows, number), rows[f'pose{number}'])
                      for number in range(self._count)]

    def _stamps(self, rows: npt.NDArray[np.void], number: int) -> Stamps:
        stamps = rows[f'sec{number}'] * np.int64(NANOSECONDS_PER_SECOND)
        stamps += rows[f'nanosec{number}']
        return stamps
