# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Decodes recorded bytes of ROS 2 and ROS 1 to transforms."""

from collections.abc import Callable, Collection, Mapping

from tf_tree_py.core.messages.frame_names import as_published, Rename, rename
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.messages.message_layout import find_layout, find_ros1_layout
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.core.messages.wire import WireReader

from ..files.message_source import MessageSource, RecordedMessage


class Decoder:
    """
    Decodes messages to transforms; remembers the layouts of each source.

    :param rename_of: returns the new names for the edges of a source, and None for those to skip;
        names are unchanged unless it is given.
    """

    def __init__(self,
                 rename_of: Callable[[MessageSource], Rename] = lambda _: as_published) -> None:
        self._rename_of = rename_of
        self._readers: dict[MessageSource, WireReader] = {}

    def read(self, arrival: RecordedMessage) -> Batch | Incident:
        """Return the transforms of a message, or the incident of invalid bytes."""
        source = arrival.source
        return self.reader_of(source).read_or_refuse(arrival.data, source.authority)

    def reader_of(self, source: MessageSource) -> WireReader:
        """Return the reader for the messages of a source."""
        reader = self._readers.get(source)
        if reader is None:
            reader = self._readers[source] = WireReader(
                self._rename_of(source), find_ros1_layout if source.ros1 else find_layout)
        return reader


def prefixed(frame_prefix: str | Mapping[str, str],
             shared_frames: Collection[str]) -> Callable[[MessageSource], Rename]:
    """
    Return a function that returns the new names for the frames of a source.

    :param frame_prefix: a prefix for every frame, such as ``robot1/``; or that of each topic.
    :param shared_frames: frames that get no prefix, such as ``map``.
    """
    def rename_of(source: MessageSource) -> Rename:
        prefix = (frame_prefix if isinstance(frame_prefix, str)
                  else frame_prefix.get(source.topic, ''))
        return rename(frame_prefix=prefix, shared_frames=shared_frames)

    return rename_of


def renames(names_of: Callable[[MessageSource], Rename],
            wanted: Rename) -> Callable[[MessageSource], Rename]:
    """
    Return a function that returns the new names for a source's edges, and None for those to skip.

    :param names_of: the new names of its frames; see ``prefixed``.
    :param wanted: returns None for an edge to skip, by its new name.
    """
    def rename_of(source: MessageSource) -> Rename:
        names = names_of(source)

        def both(parent: str, child: str) -> tuple[str, str] | None:
            edge = names(parent, child)
            return edge and wanted(*edge)

        return both

    return rename_of
