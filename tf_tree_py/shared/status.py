# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is known of a shared tree, for tools."""

from contextlib import suppress
import os
from pathlib import Path
import time
from typing import NamedTuple

from tf_tree_py.core.stamp import as_seconds, format_span
from tf_tree_py.core.tree.edge_info import counted

from .directory import Reception
from .errors import SharedTreeException
from .layout import BEAT, PID
from .place import folder, Place
from .shared_tree import PlacedTree


class Status(NamedTuple):
    """
    A shared tree at a moment.

    :ivar file: its memory.
    :ivar problem: why it cannot be read; the fields below have no meaning then.
    :ivar pid: of the process that shares it.
    :ivar silence_s: how long ago that gave its last sign of life, seconds.
    :ivar cache_time: how much history each edge keeps, nanoseconds.
    :ivar size: of the memory, bytes.
    :ivar reception: how the transforms are received, as that process said.
    """

    file: Path
    problem: str = ''
    pid: int = 0
    silence_s: float = 0.0
    frames: int = 0
    edges: int = 0
    cache_time: int = 0
    size: int = 0
    reception: Reception = {}

    @property
    def sentence(self) -> str:
        """Return the figures for people."""
        return (f'process {self.pid}, alive {self.silence_s:.2f} s ago: '
                f'{counted(self.frames, "frame")}, {counted(self.edges, "edge")}, '
                f'{format_span(self.cache_time)} of history, {self.size / 1e6:.1f} MB')

    def as_dict(self) -> dict[str, object]:
        """Return the fields for JSON, the cache time in seconds."""
        return {**self._asdict(), 'file': str(self.file),
                'cache_time': as_seconds(self.cache_time), 'reception': dict(self.reception)}


def status_of(place: Place) -> Status | None:
    """Return the status of the tree at a place; None if there is none."""
    if not place.memory.exists():
        return None
    try:
        with PlacedTree(place) as tree:
            attachment = tree.attachment
            return Status(
                place.memory, '', attachment.words[PID],
                max(0, time.monotonic_ns() - attachment.words[BEAT]) / 1e9, len(tree.frames()),
                len(tree.edges()), tree.cache_time, attachment.size(), tree.reception)
    except SharedTreeException as error:
        # It may have ended meanwhile.
        return Status(place.memory, str(error)) if place.memory.exists() else None


def all_statuses() -> list[Status]:
    """Return the status of each tree of this user."""
    places = [Place(name=path.stem) for path in sorted(folder().glob('domain-*.tree'))]
    return [status for status in map(status_of, places) if status is not None]


def readers_of(status: Status) -> list[int]:
    """Return the processes of this user that have the memory of a tree open, without its own."""
    readers = set()
    for descriptor in Path('/proc').glob('[0-9]*/fd/*'):
        with suppress(OSError):  # of another user, or gone
            if os.readlink(descriptor) == str(status.file):
                readers.add(int(descriptor.parts[2]))
    return sorted(readers - {status.pid, os.getpid()})
