# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The connections of a bag: a topic, or one publisher of it if the bag names them.

Messages of any type that rosbags or the list below defines are deserialized here. The unpacked
size of a compressed part has a limit: kilobytes can hold gigabytes of zeros.

The bytes of messages of ROS 1 have no encapsulation, no alignment and no NULs, and are
little-endian. A header begins with a uint32 seq, and seconds are unsigned.
"""

from collections.abc import Collection, Iterator, Mapping
from functools import cache
import os
from typing import Any, NamedTuple, Protocol, TYPE_CHECKING

from tf_tree_py.beyond.uncertainty.insertion import STATIC_COVARIANCE_TOPIC
from tf_tree_py.core.messages.byte_cursor import ByteCursor, cdr_cursor, text_of, WireError
from tf_tree_py.core.messages.message_layout import MessageLayout, read_layout, Rename

if TYPE_CHECKING:
    from rosbags.interfaces import MessageDefinition
    from rosbags.typesys.store import Typestore

_ODOMETRY = 'nav_msgs/Odometry'

CDR, ROS1 = 'cdr', 'ros1'
"""The encodings of messages of ROS 2 and ROS 1."""

JSON, PROTOBUF = 'json', 'protobuf'
"""Encodings of Foxglove's messages, as in MCAP's registry (https://mcap.dev/spec/registry)."""

# The types with transforms, and the encodings in which they are read.
_OF_ROS, _OF_FOXGLOVE = (CDR, ROS1), (JSON, PROTOBUF)
_TRANSFORMS = {
    'tf2_msgs/TFMessage': _OF_ROS,
    'tf/tfMessage': _OF_ROS,
    'foxglove_msgs/FrameTransform': _OF_ROS,
    'foxglove_msgs/FrameTransforms': _OF_ROS,
    'foxglove.FrameTransform': _OF_FOXGLOVE,
    'foxglove.FrameTransforms': _OF_FOXGLOVE,
}


class Connection(NamedTuple):
    """
    One topic of a bag; in a ROS 1 bag one publisher's messages on it.

    :ivar type_name: of its messages, as in the bag.
    :ivar latched: whether late joiners receive the last message: transient local, or ROS 1's
        latched.
    :ivar publisher: the node that published, if the bag names it; otherwise ''.
    :ivar encoding: of its messages, as MCAP names it: ``cdr``, ``ros1``, ``json``, ...
    :ivar reliable: whether all publishers were reliable, as far as the bag contains that; tf2 does
        not receive others.
    :ivar volatile: whether a publisher was volatile: late joiners receive none of its messages.
    """

    topic: str
    type_name: str
    latched: bool
    publisher: str
    encoding: str = CDR
    reliable: bool = True
    volatile: bool = False

    @property
    def has_transforms(self) -> bool:
        """Return whether its messages are TFMessages, of tf2 or ROS 1's tf, or Foxglove's."""
        return self.encoding in self.readable_encodings

    @property
    def has_foxglove_transforms(self) -> bool:
        """Return whether ``foxglove`` reads transforms from its messages."""
        return self.type_name.startswith('foxglove') and self.has_transforms

    @property
    def readable_encodings(self) -> tuple[str, ...]:
        """Return the encodings in which transforms of its type are read; none for other types."""
        return _TRANSFORMS.get(self.short_type, ())

    @property
    def has_static_covariances(self) -> bool:
        """Return whether it has the covariances of ``static_transform_publisher``."""
        return (self.topic.endswith(STATIC_COVARIANCE_TOPIC) and self.short_type == _ODOMETRY
                and self.is_of_ros)

    @property
    def ros1(self) -> bool:
        """Return whether the messages are ROS 1's bytes."""
        return self.encoding == ROS1

    @property
    def is_of_ros(self) -> bool:
        """Return whether the messages are in an encoding of ROS 2 or ROS 1."""
        return self.encoding in _OF_ROS

    @property
    def short_type(self) -> str:
        """Return the type of its messages without ``msg``, such as ``tf2_msgs/TFMessage``."""
        return self.type_name.replace('/msg/', '/')

    @property
    def contents(self) -> str:
        """Return the type of its messages in words, with the encoding where that matters."""
        of_type = f'of type {self.short_type}' if self.type_name else 'without a type'
        matters = not self.is_of_ros or (self.readable_encodings and not self.has_transforms)
        return f'messages {of_type}{f" in {self.encoding}" if matters else ""}'

    @property
    def static(self) -> bool:
        """Return whether its transforms are valid at all times."""
        return self.topic.endswith('_static') or self.latched

    @property
    def authority(self) -> str:
        """Return the name for incidents: the publisher, or else the topic."""
        return self.publisher or self.topic


class RecordedMessage(NamedTuple):
    """
    One message as it was received.

    :ivar received: the time of receiving, nanoseconds of the recorder's clock, which may differ
        from that of the stamps in the message.
    :ivar data: its bytes; see ``Connection.encoding``.
    """

    received: int
    connection: Connection
    data: bytes


class Storage(Protocol):
    """
    One open file.

    :ivar span: when its first message was received, and one nanosecond after the last.
    :ivar damage: the faults of the file, one sentence each; complete after all was read.
    :ivar definitions: of the messages of each connection, where the file has them.
    """

    span: tuple[int, int]
    damage: list[str]
    definitions: 'dict[Connection, MessageDefinition]'

    @property
    def counts(self) -> Mapping[Connection, int]:
        """Return all recorded connections, of any type, and the number of messages of each."""

    def arrivals(self, connections: Collection[Connection], start: int | None,
                 stop: int | None) -> Iterator[RecordedMessage]:
        """
        Yield the messages of some of its connections, in order of arrival.

        :param start: the time of receiving of the first, nanoseconds; None: from the beginning.
        :param stop: the end of the time of receiving, exclusive; None: to the end.
        """

    def close(self) -> None:
        """Close the file."""


class Scan(Protocol):
    """
    Reads one file, record by record.

    :ivar definitions: of the messages of each connection, once it was found.
    :ivar lost: how much could not be read, in words; complete after the last message.
    """

    definitions: 'dict[Connection, MessageDefinition]'
    lost: str

    def __iter__(self) -> Iterator[RecordedMessage]:
        """Yield every message, in the order of the file."""


# --- messages of any type

# Types that rosbags does not define. The files of a recorder that was killed have no definitions.
_DEFINITIONS = {
    'vision_msgs/msg/ObjectHypothesis': 'string class_id\nfloat64 score\n',
    'vision_msgs/msg/ObjectHypothesisWithPose':
        'vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n',
    'vision_msgs/msg/BoundingBox3D': 'geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n',
    'vision_msgs/msg/Detection3D':
        'std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n'
        'vision_msgs/BoundingBox3D bbox\nstring id\n',
    'vision_msgs/msg/Detection3DArray':
        'std_msgs/Header header\nvision_msgs/Detection3D[] detections\n',
    'apriltag_ros/msg/AprilTagDetection':
        'int32[] id\nfloat64[] size\ngeometry_msgs/PoseWithCovarianceStamped pose\n',
    'apriltag_ros/msg/AprilTagDetectionArray':
        'std_msgs/Header header\napriltag_ros/AprilTagDetection[] detections\n',
    'isaac_ros_apriltag_interfaces/msg/AprilTagDetection':
        'string family\nint32 id\ngeometry_msgs/Point center\ngeometry_msgs/Point[4] corners\n'
        'geometry_msgs/PoseWithCovarianceStamped pose\n',
    'foxglove_msgs/msg/FrameTransform':
        'builtin_interfaces/Time timestamp\nstring parent_frame_id\nstring child_frame_id\n'
        'geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n',
    'foxglove_msgs/msg/FrameTransforms': 'foxglove_msgs/FrameTransform[] transforms\n',
    'isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray':
        'std_msgs/Header header\n'
        'isaac_ros_apriltag_interfaces/AprilTagDetection[] detections\n',
}


def decode(connection: Connection, data: bytes) -> Any:
    """
    Return a message of ROS as an object with its fields.

    :raises WireError: the type is unknown, or the bytes are damaged.
    """
    store = typestore(connection.ros1)
    read = store.deserialize_ros1 if connection.ros1 else store.deserialize_cdr
    try:
        package, *_, name = connection.type_name.split('/')
        return read(data, f'{package}/msg/{name}')
    except Exception as error:  # noqa: B902 - rosbags raises many kinds
        raise WireError(f'the message cannot be decoded: {error}') from error


@cache
def typestore(ros1: bool) -> 'Typestore':
    """Return rosbags' types of ROS 1 or 2, and those above."""
    from rosbags.typesys import get_types_from_msg, get_typestore, Stores
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    for name, text in _DEFINITIONS.items():
        if name not in store.fielddefs:
            store.register(get_types_from_msg(text, name))
    return store


# --- the limit of unpacked sizes

VARIABLE = 'TF_TREE_PY_MAX_UNPACKED'
"""The environment variable that sets the limit, in bytes."""

# Messages with transforms are compressed to a twentieth at best.
ALWAYS, TIMES = 256 * 2**20, 200


class TooLarge(ValueError):
    """A part of a bag unpacks to more than the limit."""


def unpacked_limit(packed: int) -> int:
    """
    Return how many bytes a compressed part may unpack to.

    :param packed: its compressed size, bytes.
    """
    given = os.environ.get(VARIABLE, '')
    return int(given) if given.isdecimal() else max(ALWAYS, TIMES * packed)


def too_large(what: str, packed: int) -> TooLarge:
    """Return the error for a part of a bag that unpacks to more."""
    return TooLarge(f'{what} of {packed:,} bytes unpacks to more than '
                    f'{unpacked_limit(packed):,}; {VARIABLE} sets that limit')


# --- the bytes of messages of ROS 1

class Ros1ByteCursor(ByteCursor):
    """A position in the bytes of a message of ROS 1."""

    head = 4
    stamp = 'II'

    def __init__(self, data: bytes) -> None:
        super().__init__(data, '<')
        self.position = 0

    def skip(self, size: int, alignment: int) -> int:
        """Skip a field, which is not aligned, and return its position."""
        return super().skip(size, 1)

    def skip_stamp(self) -> int:
        """Skip a seq and a stamp, and return the position of the stamp."""
        return self.skip(12, alignment=1) + 4

    def _decoded(self, text: bytes, begin: int) -> str:
        return text_of(text, begin)


def cursor_of(data: bytes, ros1: bool) -> ByteCursor:
    """
    Return a cursor at the beginning of a message.

    :param ros1: whether these are the bytes of ROS 1; otherwise they are CDR.
    :raises WireError: the bytes do not begin with the encapsulation of CDR.
    """
    return Ros1ByteCursor(data) if ros1 else cdr_cursor(data)


def find_ros1_layout(data: bytes, rename: Rename) -> MessageLayout:
    """
    Return the layout of a TFMessage of ROS 1; see ``find_layout``.

    :raises WireError: the bytes are not a TFMessage.
    """
    return read_layout(Ros1ByteCursor(data), rename)
