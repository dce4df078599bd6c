# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Decodes many consecutive messages together, edge by edge.

The bytes of all messages of one layout are one array, in which numpy reads the numbers in place.
Messages for which that is impossible are read one by one.
"""

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.message_layout import Key, key_of
from tf_tree_py.core.messages.sample import SampleTrack
from tf_tree_py.core.messages.wire import WireReader
from tf_tree_py.core.times import Stamps

from .decoding import Decoder
from ..files.message_source import RecordedMessage

# Messages of one size and first name with more layouts than this are read one by one.
_MAX_LAYOUTS = 8

Edge = tuple[str, str]
_Numbers = npt.NDArray[np.intp]


class Samples(NamedTuple):
    """
    One edge's samples in a window, in order of arrival.

    :ivar messages: (n,) the number of each sample's message in the window, sorted.
    :ivar stamps: (n,) nanoseconds.
    :ivar poses: (n, 7) ``parent_T_child``, not checked yet.
    """

    messages: _Numbers
    stamps: Stamps
    poses: Array

    def between(self, begin: int, end: int) -> 'Samples':
        """Return the samples of the messages from one number up to another, exclusive."""
        some = slice(*self.messages.searchsorted((begin, end)).tolist())
        return Samples(self.messages[some], self.stamps[some], self.poses[some])

    def as_track(self, edge: Edge) -> SampleTrack:
        """Return the samples as a track for the core."""
        return SampleTrack(*edge, self.stamps, self.poses)


class MessageWindow(NamedTuple):
    """
    Consecutive messages, decoded.

    :ivar edges: the samples of every edge.
    :ivar others: numbers of the messages that are not in ``edges``, sorted: static ones, and those
        that cannot be read together with others.
    """

    edges: dict[Edge, Samples]
    others: list[int]


def decode(arrivals: Sequence[RecordedMessage], decoder: Decoder) -> MessageWindow:
    """Return messages, decoded together."""
    # By the identity of the source: a comparison of sources takes longer than the rest of this.
    alike: dict[tuple[int, Key], list[int]] = defaultdict(list)
    others: list[int] = []
    for number, (_, source, data) in enumerate(arrivals):
        if source.static:
            others.append(number)
        else:
            alike[id(source), key_of(data)].append(number)
    parts: dict[Edge, list[Samples]] = defaultdict(list)
    for numbers in alike.values():
        reader = decoder.reader_of(arrivals[numbers[0]].source)
        others += _add_alike(arrivals, numbers, reader, parts)
    return MessageWindow({edge: _joined(samples) for edge, samples in parts.items()},
                         sorted(others))


def _add_alike(arrivals: Sequence[RecordedMessage], numbers: list[int], reader: WireReader,
               parts: dict[Edge, list[Samples]]) -> list[int]:
    """Decode messages of one size and first name; return the numbers of undecodable ones."""
    left = np.array(numbers)
    for _ in range(_MAX_LAYOUTS):
        try:
            layout = reader.layout_of(arrivals[left[0]].data)
        except WireError:
            break
        fits, stamps, poses = layout.block.read([arrivals[number].data for number in left])
        for edge, *columns in zip(layout.edges, stamps, poses, strict=True):
            parts[edge].append(Samples(left[fits], *columns))
        left = left[~fits]
        if not len(left):
            break
    return [int(number) for number in left]


def _joined(samples: list[Samples]) -> Samples:
    """Return samples of one edge in order of arrival; those of one message keep their order."""
    if len(samples) == 1:
        return samples[0]
    messages, stamps, poses = (np.concatenate(column) for column in zip(*samples, strict=True))
    order = np.argsort(messages, kind='stable')
    return Samples(messages[order], stamps[order], poses[order])
