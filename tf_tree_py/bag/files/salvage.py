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

"""
Files that rosbags refuses: cut off, never finished, without an index.

They are read from the beginning, record by record, as far as that goes. Each kind has a
scan; what all of them need stands here.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
import mmap
from pathlib import Path
import struct

from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
from tf_tree_py.core.stamp import FOREVER

from .rosbags_file import first_field_of, salvaged
from .source import Arrival, Scan, Source


class SalvagedFile:
    """What can be read of one file."""

    def __init__(self, path: Path, scan: Callable[[Path], Scan], why: object) -> None:
        """
        Read it once, to see what there is.

        :param why: it cannot be read as it should be.
        :raises ValueError: nothing can be read.
        """
        self._path = path
        self._scan = scan
        first = scan(path)
        self.counts: Counter[Source] = Counter()
        begin, end = FOREVER, 0
        for arrival in first:
            self.counts[arrival.source] += 1
            begin, end = min(begin, arrival.received), max(end, arrival.received + 1)
        self.span = begin, end
        self._definitions = first.definitions
        self.damage = [f'{path.name} is not whole ({str(why).rstrip(".")}): '
                       f'{self.counts.total()} messages could be read, {first.lost}']

    def arrivals(self, sources: Collection[Source], start: int | None,
                 stop: int | None) -> Iterator[Arrival]:
        """Yield the messages of some of its sources, as they stand in the file."""
        return salvaged(self._scan(self._path), sources, start, stop)

    def first_field(self, source: Source) -> str:
        """Return the type of the first field of a source's messages; '' if it is not known."""
        if source not in self._definitions:
            return ''
        return first_field_of(source, self._definitions[source])

    def close(self) -> None:
        """Nothing is open."""


def mapped(path: Path, magic: bytes, kind: str) -> memoryview:
    """
    Return the bytes of a file.

    :param magic: what it begins with.
    :param kind: of the file, for the error.
    :raises ValueError: it begins with something else, or it is empty.
    """
    with path.open('rb') as file:
        data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if data[:len(magic)] != magic:
        raise ValueError(f'it does not begin as {kind} does')
    return data


def definition(text: str, encoding: str = 'ros2msg') -> MessageDefinition:
    """Return a definition of messages, from the text and the encoding that a file has."""
    kind = {'ros2msg': MessageDefinitionFormat.MSG, 'ros1msg': MessageDefinitionFormat.MSG,
            'ros2idl': MessageDefinitionFormat.IDL}.get(encoding, MessageDefinitionFormat.NONE)
    return MessageDefinition(kind, text)


def lost_bytes(lost: int, size: int, ended: bool = False) -> str:
    """
    Say how much of a file could not be read.

    :param ended: there was an end, and not only nothing more.
    """
    if not lost:
        return 'and nothing is missing' + ('' if ended else ' but its end with the index')
    return f'and {lost:,} of its {size:,} bytes could not'


class Cut(Exception):
    """The bytes end in the middle of something."""


class Bytes:
    """A position in bytes, and methods that read on from there; numbers are little-endian."""

    def __init__(self, data: memoryview) -> None:
        self.data = data
        self.position = 0

    def __bool__(self) -> bool:
        return self.position < len(self.data)

    @property
    def left(self) -> int:
        """Return how many bytes there are behind the position."""
        return len(self.data) - self.position

    def take(self, size: int) -> memoryview:
        """
        Return the next bytes.

        :raises Cut: there are not as many.
        """
        if size > self.left:
            raise Cut
        self.position += size
        return self.data[self.position - size:self.position]

    def number(self, letter: str) -> int:
        """Return the next number, of struct's letter."""
        (value,) = struct.unpack('<' + letter, self.take(struct.calcsize(letter)))
        return int(value)

    def sized(self) -> memoryview:
        """Return bytes that stand behind their number."""
        return self.take(self.number('I'))

    def text(self) -> str:
        """Return a string that stands behind its number of bytes."""
        return bytes(self.sized()).decode(errors='replace')
