# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Many messages with the same names, read together: their bytes are one array for numpy."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..edges.columns import POSE_FLOATS
from ..geometry.so3 import Array
from ..stamp import NANOSECONDS_PER_SECOND
from ..times import Stamps

# struct's letters for numbers, as numpy writes them.
_TYPES = {'i': 'i4', 'I': 'u4'}

# Bytes of messages that are read at a time: they fit into every cache.
_CACHED_BYTES = 500_000

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
        # A stamp is two neighbouring numbers of four bytes.
        self._stamps = np.concatenate(
            [np.arange(place.stamp, place.stamp + 8) for place in places] or [self._fixed[:0]])
        self._stamp = np.dtype([(name, order + _TYPES[letter]) for name, letter
                                in zip(('sec', 'nanosec'), stamp, strict=True)])
        pose = np.dtype((f'{order}f8', POSE_FLOATS))
        self._type = np.dtype({
            'names': ['bytes', *(f'pose{number}' for number in range(len(places)))],
            'formats': [np.dtype((np.uint8, size)), *(pose for _ in places)],
            'offsets': [0, *(place.pose for place in places)], 'itemsize': size})
        self._count = len(places)

    def read(self, messages: Sequence[bytes]) -> tuple[Bools, Stamps, Array]:
        """
        Return which messages have the names, and the samples of those.

        :param messages: n, each of the same size.
        :return: (n,) booleans; of the k transforms that are wanted the stamps (k, m) and the
            poses (k, m, 7), not checked yet.
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
            np.multiply(pairs['sec'], NANOSECONDS_PER_SECOND, out=stamps[:, some], dtype=np.int64)
            stamps[:, some] += pairs['nanosec']
            for number in range(self._count):
                poses[number, some] = rows[f'pose{number}']
        if fits.all():
            return fits, stamps, poses
        return fits, stamps[:, fits], poses[:, fits]
