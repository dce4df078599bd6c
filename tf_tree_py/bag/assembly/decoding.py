# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Decodes recorded bytes of ROS 2, ROS 1 and Foxglove to transforms, one message or many together.

The bytes of all messages of one layout are one array, in which numpy reads the numbers in place.
Messages for which that is impossible are read one by one.
"""

from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt
from tf_tree_py.core.edges.packed import POSE_FLOATS
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.message_layout import (
    as_published,
    find_layout,
    Key,
    key_of,
    MessageLayout,
    Rename,
)
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.messages.wire import malformed, WireReader
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.times import Stamps
from tf_tree_py.frame_names import rename

from ..files.connections import Connection, find_ros1_layout, RecordedMessage
from ..files.foxglove import as_tf_message

# struct's letters for numbers, as numpy writes them.
_TYPES = {'i': 'i4', 'I': 'u4'}

# Bytes of messages that are read at a time; they fit into the cache of any processor.
_CACHED_BYTES = 500_000

_Bools = npt.NDArray[np.bool_]


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

    def read(self, messages: Sequence[bytes]) -> tuple[_Bools, Stamps, Array]:
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


def _block_of(layout: MessageLayout) -> MessageBlock:
    """Return the block of a layout, which is made once, and lives as long as the layout."""
    block = _blocks.get(layout)
    if block is None:
        block = _blocks[layout] = MessageBlock(layout)
    return block


class Decoder:
    """
    Decodes messages to transforms; remembers the layouts of each connection.

    :param rename_of: returns the new names of a connection's edges, and None for those to skip;
        names are unchanged unless it is given.
    """

    def __init__(self,
                 rename_of: Callable[[Connection], Rename] = lambda _: as_published) -> None:
        self._rename_of = rename_of
        self._readers: dict[Connection, WireReader] = {}

    def read(self, arrival: RecordedMessage) -> Batch | Incident:
        """Return the transforms of a message, or the incident of invalid bytes."""
        connection = arrival.connection
        try:
            return self.reader_of(connection).read(_bytes_of(arrival))
        except WireError as error:
            return malformed(WireError(f'on {connection.topic}: {error}'), connection.authority)

    def reader_of(self, connection: Connection) -> WireReader:
        """Return the reader for the messages of a connection."""
        reader = self._readers.get(connection)
        if reader is None:
            ros1 = connection.ros1 and not connection.has_foxglove_transforms
            reader = self._readers[connection] = WireReader(
                self._rename_of(connection), find_ros1_layout if ros1 else find_layout,
                static=connection.static)
        return reader


def _bytes_of(arrival: RecordedMessage) -> bytes:
    """
    Return the bytes of a TFMessage with the transforms of a message.

    :raises WireError: they are in a message of Foxglove that cannot be decoded.
    """
    return as_tf_message(arrival) if arrival.connection.has_foxglove_transforms else arrival.data


def prefixed(frame_prefix: str | Mapping[str, str],
             shared_frames: Collection[str]) -> Callable[[Connection], Rename]:
    """
    Return a function that returns the new names for the frames of a connection.

    :param frame_prefix: a prefix for every frame, such as ``robot1/``; or that of each topic.
    :param shared_frames: frames that get no prefix, such as ``map``.
    """
    def rename_of(connection: Connection) -> Rename:
        prefix = (frame_prefix if isinstance(frame_prefix, str)
                  else frame_prefix.get(connection.topic, ''))
        return rename(frame_prefix=prefix, shared_frames=shared_frames)

    return rename_of


def renames(names_of: Callable[[Connection], Rename],
            wanted: Callable[[str, str], bool]) -> Callable[[Connection], Rename]:
    """
    Return a function of a connection: the new names of its edges, and None for those to skip.

    :param names_of: the new names of its frames; see ``prefixed``.
    :param wanted: returns whether to take an edge, by its new names.
    """
    def rename_of(connection: Connection) -> Rename:
        names = names_of(connection)

        def both(parent: str, child: str) -> tuple[str, str] | None:
            edge = names(parent, child)
            return edge if edge and wanted(*edge) else None

        return both

    return rename_of


# --- many messages together

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


class MessageWindow(NamedTuple):
    """
    Consecutive messages, decoded.

    :ivar received: (n,) when each message was received, nanoseconds.
    :ivar edges: the samples of every edge.
    :ivar others: numbers of the messages that are not in ``edges``, sorted: static ones, and those
        that cannot be read together with others.
    """

    received: Stamps
    edges: dict[Edge, Samples]
    others: list[int]


def decode(arrivals: Sequence[RecordedMessage], decoder: Decoder) -> MessageWindow:
    """Return messages, decoded together."""
    # By the identity of the connection: comparing two takes longer than the rest of this.
    alike: dict[tuple[int, Key], list[int]] = defaultdict(list)
    kinds: dict[int, tuple[bool, bool]] = {}
    datas: list[bytes] = []
    others: list[int] = []
    for number, arrival in enumerate(arrivals):
        _, connection, data = arrival
        place = id(connection)
        if place not in kinds:
            kinds[place] = connection.static, connection.has_foxglove_transforms
        static, foxglove = kinds[place]
        if foxglove and not static:
            data = _bytes_or_none(arrival)
        datas.append(data)
        if static or not data:
            others.append(number)
        else:
            alike[place, key_of(data)].append(number)
    parts: dict[Edge, list[Samples]] = defaultdict(list)
    for numbers in alike.values():
        reader = decoder.reader_of(arrivals[numbers[0]].connection)
        others += _add_alike(datas, numbers, reader, parts)
    received = np.array([arrival.received for arrival in arrivals], np.int64)
    return MessageWindow(received, {edge: _joined(samples) for edge, samples in parts.items()},
                         sorted(others))


def _bytes_or_none(arrival: RecordedMessage) -> bytes:
    """Return the bytes of a TFMessage; none if the message cannot be decoded."""
    try:
        return _bytes_of(arrival)
    except WireError:
        return b''


def _add_alike(datas: Sequence[bytes], numbers: list[int], reader: WireReader,
               parts: dict[Edge, list[Samples]]) -> list[int]:
    """Decode messages of one size and first name; return the numbers of undecodable ones."""
    left = np.array(numbers)
    for _ in range(_MAX_LAYOUTS):
        try:
            layout = reader.layout_of(datas[left[0]])
        except WireError:
            break
        fits, stamps, poses = _block_of(layout).read([datas[number] for number in left])
        for edge, *columns in zip(layout.edges, stamps, poses, strict=True):
            parts[edge].append(Samples(left[fits], *columns))
        left = left[~fits]
        if not len(left) or not fits.any():
            break
    return [int(number) for number in left]


def _joined(samples: list[Samples]) -> Samples:
    """Return samples of one edge in order of arrival; those of one message keep their order."""
    if len(samples) == 1:
        return samples[0]
    messages, stamps, poses = (np.concatenate(column) for column in zip(*samples, strict=True))
    order = np.argsort(messages, kind='stable')
    return Samples(messages[order], stamps[order], poses[order])
