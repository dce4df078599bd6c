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

"""From recorded bytes to transforms, whichever ROS wrote them."""

from collections.abc import Callable, Collection, Mapping

from tf_tree_py.core.arrivals.frame_names import as_published, Rename, rename
from tf_tree_py.core.arrivals.incidents import Incident
from tf_tree_py.core.arrivals.layout import find_layout, find_ros1_layout
from tf_tree_py.core.arrivals.sample import Batch
from tf_tree_py.core.arrivals.wire import WireReader

from ..files.source import Arrival, Source


class Decoder:
    """
    Makes transforms of arrivals; remembers the layouts of each source.

    :param rename_of: how the edges of a source are called, and which are left out; they are
        called as they were published unless this is given.
    """

    def __init__(self, rename_of: Callable[[Source], Rename] = lambda _: as_published) -> None:
        self._rename_of = rename_of
        self._readers: dict[Source, WireReader] = {}

    def read(self, arrival: Arrival) -> Batch | Incident:
        """Return the transforms of a message, or what is wrong with its bytes."""
        source = arrival.source
        return self.reader_of(source).read_or_refuse(arrival.data, source.authority)

    def reader_of(self, source: Source) -> WireReader:
        """Return who reads the messages of a source."""
        reader = self._readers.get(source)
        if reader is None:
            reader = self._readers[source] = WireReader(
                self._rename_of(source), find_ros1_layout if source.ros1 else find_layout)
        return reader


def prefixed(frame_prefix: str | Mapping[str, str],
             shared_frames: Collection[str]) -> Callable[[Source], Rename]:
    """
    Return how the frames of a source are called.

    :param frame_prefix: what to write before every frame, such as ``robot1/``; or that of
        each topic.
    :param shared_frames: frames that keep their name, such as ``map``.
    """
    def rename_of(source: Source) -> Rename:
        prefix = (frame_prefix if isinstance(frame_prefix, str)
                  else frame_prefix.get(source.topic, ''))
        return rename(frame_prefix=prefix, shared_frames=shared_frames)

    return rename_of


def renames(names_of: Callable[[Source], Rename], wanted: Rename) -> Callable[[Source], Rename]:
    """
    Return how the edges of a source are called, and which are left out.

    :param names_of: how its frames are called; see ``prefixed``.
    :param wanted: returns None of an edge to leave out, by its new name.
    """
    def rename_of(source: Source) -> Rename:
        names = names_of(source)

        def both(parent: str, child: str) -> tuple[str, str] | None:
            edge = names(parent, child)
            return edge and wanted(*edge)

        return both

    return rename_of
