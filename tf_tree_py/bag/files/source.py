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

"""Where recorded messages come from: one topic, or one publisher of it where a bag tells them."""

from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple, Protocol, TYPE_CHECKING

from tf_tree_py.core.arrivals.estimate import STATIC_COVARIANCE_TOPIC

if TYPE_CHECKING:
    from rosbags.interfaces import MessageDefinition

_TRANSFORMS = {('tf2_msgs', 'TFMessage'), ('tf', 'tfMessage')}
_ODOMETRY = ('nav_msgs', 'Odometry')


class Source(NamedTuple):
    """
    One topic of a bag; in a ROS 1 bag one publisher's messages on it.

    :ivar type_name: of its messages, as the bag writes it.
    :ivar latched: whether late listeners get the last message: transient local, or ROS 1's
        latched.
    :ivar publisher: the node that published, where the bag tells; else ''.
    :ivar ros1: whether the messages are ROS 1's bytes; else they are CDR.
    :ivar reliable: whether all publishers were, as far as the bag tells; tf2 does not hear
        others.
    :ivar volatile: whether one said that late listeners get nothing of what it sent.
    """

    topic: str
    type_name: str
    latched: bool
    publisher: str
    ros1: bool
    reliable: bool = True
    volatile: bool = False

    @property
    def has_transforms(self) -> bool:
        """Return whether its messages are TFMessages, of tf2 or of ROS 1's tf."""
        return self._type in _TRANSFORMS

    @property
    def has_static_covariances(self) -> bool:
        """Return whether it is where ``static_transform_publisher`` tells of covariances."""
        return self.topic.endswith(STATIC_COVARIANCE_TOPIC) and self._type == _ODOMETRY

    @property
    def _type(self) -> tuple[str, str]:
        package, *_, name = self.type_name.split('/')
        return package, name

    @property
    def static(self) -> bool:
        """Return whether its transforms are valid at all times."""
        return self.topic.endswith('_static') or self.latched

    @property
    def authority(self) -> str:
        """Return who is named where something is wrong: the publisher, or else the topic."""
        return self.publisher or self.topic


class Arrival(NamedTuple):
    """
    One message as it was received.

    :ivar received: when, nanoseconds of the recorder's clock, which need not be that of the
        stamps in the message.
    :ivar data: its bytes; see ``Source.ros1``.
    """

    received: int
    source: Source
    data: bytes


class Storage(Protocol):
    """
    One open file.

    :ivar span: when its first message was received, and the nanosecond after the last.
    :ivar damage: what is wrong with the file, one sentence each; complete when all was read.
    """

    span: tuple[int, int]
    damage: list[str]

    @property
    def counts(self) -> Mapping[Source, int]:
        """Return everything that was recorded, of any type, and how many messages of each."""

    def arrivals(self, sources: Collection[Source], start: int | None,
                 stop: int | None) -> Iterator[Arrival]:
        """
        Yield the messages of some of its sources, as they were received.

        :param start: from when on, nanoseconds; None: from the beginning.
        :param stop: until when, without that; None: to the end.
        """

    def first_field(self, source: Source) -> str:
        """Return the type of the first field of a source's messages; '' if it is not known."""

    def close(self) -> None:
        """Close the file."""


class Scan(Protocol):
    """
    Reads one file, record by record.

    :ivar definitions: of the messages of each source, once it was met.
    :ivar lost: how much could not be read, in words; complete after the last arrival.
    """

    definitions: 'dict[Source, MessageDefinition]'
    lost: str

    def __iter__(self) -> Iterator[Arrival]:
        """Yield every message, in the order in which they stand in the file."""
