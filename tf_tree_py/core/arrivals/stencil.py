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

"""TFMessages of the same edges, again and again, of which only stamp and poses change."""

from collections.abc import Iterable
from itertools import accumulate

import numpy as np

from .sample import as_sec_nanosec, Sample
from .wire import write
from ..edges.packed import POSE_BYTES
from ..geometry import se3
from ..geometry.so3 import Array
from ..stamp import LATEST

# Everything is aligned relative to the byte after the encapsulation.
_ENCAPSULATION_BYTES = 4
_HEAD_BYTES = 8  # encapsulation and count


class Stencil:
    """
    One serialized message, into which numbers are written: a tenth of the work of ``write``.

    A transform begins where the one before it ends: first comes its stamp, last its pose.
    """

    def __init__(self, edges: Iterable[tuple[str, str]]) -> None:
        """
        Write what does not change.

        :param edges: (parent, child) of each transform.
        """
        samples = [Sample(parent, child, LATEST, se3.IDENTITY) for parent, child in edges]
        self._data = bytearray(write(samples))
        # All but the first begin at the same alignment.
        first = len(write(samples[:1]))
        ends = list(accumulate((len(write([samples[0], sample])) - first
                                for sample in samples[1:]), initial=first))[:len(samples)]
        self._words, self._doubles = (
            np.frombuffer(self._data, kind, (len(self._data) - _ENCAPSULATION_BYTES) // width,
                          _ENCAPSULATION_BYTES) for kind, width in (('<i4', 4), ('<f8', 8)))
        begins = np.array([_HEAD_BYTES, *ends][:len(samples)], np.intp)
        self._stamps = (begins - _ENCAPSULATION_BYTES) // 4
        poses = np.array(ends, np.intp) - POSE_BYTES
        self._poses = (poses[:, None] - _ENCAPSULATION_BYTES) // 8 + np.arange(7)

    def fill(self, stamp: int, poses: Array) -> bytes:
        """
        Return the message with one stamp, and with poses (edges, 7).

        :raises InvalidArgumentException: a stamp that no message can hold.
        """
        self._words[self._stamps], self._words[self._stamps + 1] = as_sec_nanosec(stamp)
        self._doubles[self._poses] = poses
        return bytes(self._data)
