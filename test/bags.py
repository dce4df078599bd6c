"""Bags of every kind, written by rosbags, and what is in them."""

from typing import NamedTuple

import numpy as np
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import get_typestore, Stores
from serialized import serialize, serialize_ros1

SECOND = 10**9
LATCHED = 'latched'
BEST_EFFORT = 'best effort'
TF_MESSAGE = 'tf2_msgs/msg/TFMessage'

JAZZY = get_typestore(Stores.ROS2_JAZZY)
NOETIC = get_typestore(Stores.ROS1_NOETIC)
NOETIC.register(dict.fromkeys([TF_MESSAGE, 'tf/msg/tfMessage'], JAZZY.fielddefs[TF_MESSAGE]))


class Message(NamedTuple):
    """
    One message with transforms.

    :ivar received: nanoseconds.
    :ivar transforms: (parent, child, stamp in nanoseconds, pose) of each.
    :ivar qos: ``LATCHED``, ``BEST_EFFORT`` or nothing.
    :ivar publisher: of a ROS 1 bag.
    """

    received: int
    topic: str
    transforms: list
    qos: str = ''
    publisher: str = ''
    type_name: str = TF_MESSAGE
    data: bytes | None = None


def random_pose(rng):
    """Return any pose within a metre, as plain floats."""
    pose = rng.normal(size=7)
    pose[3:] /= np.linalg.norm(pose[3:])
    return tuple(pose.tolist())


def as_cdr(transforms):
    return serialize([(parent, child, *divmod(stamp, SECOND), pose)
                      for parent, child, stamp, pose in transforms])


def as_ros1(transforms):
    return serialize_ros1([(parent, child, *divmod(stamp, SECOND), pose)
                           for parent, child, stamp, pose in transforms])


def profile(qos):
    zero = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST, 10,
        QosReliability.BEST_EFFORT if qos == BEST_EFFORT else QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if qos == LATCHED else QosDurability.VOLATILE,
        zero, zero, QosLiveliness.AUTOMATIC, zero, False)


def write_ros2(path, messages, storage='mcap', compression=None):
    """Write a folder as rosbag2 does, and return it."""
    plugin = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}[storage]
    writer = Writer2(path, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for message in messages:
            key = message.topic, message.qos
            if key not in connections:
                connections[key] = writer.add_connection(
                    message.topic, message.type_name, typestore=JAZZY,
                    offered_qos_profiles=[profile(message.qos)])
            data = as_cdr(message.transforms) if message.data is None else message.data
            writer.write(connections[key], message.received, data)
    return path


def write_ros1(path, messages, compression=None):
    """Write a file as ROS 1 does, and return it."""
    writer = Writer1(path)
    if compression:
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    connections = {}
    with writer:
        for message in messages:
            key = message.topic, message.qos, message.publisher
            if key not in connections:
                connections[key] = writer.add_connection(
                    message.topic, message.type_name, typestore=NOETIC,
                    callerid=message.publisher or '/somebody',
                    latching=int(message.qos == LATCHED))
            data = as_ros1(message.transforms) if message.data is None else message.data
            writer.write(connections[key], message.received, data)
    return path


def write_split(path, parts, **options):
    """Write a bag of several files into one folder, as a recorder that splits does."""
    path.mkdir()
    names = []
    for number, messages in enumerate(parts):
        part = write_ros2(path.parent / f'{path.name}_{number}', messages, **options)
        [file] = [file for file in part.iterdir() if file.name != 'metadata.yaml']
        names.append(file.rename(path / file.name).name)
    listed = '\n'.join(f'    - {name}' for name in names)
    (path / 'metadata.yaml').write_text(
        f'rosbag2_bagfile_information:\n  version: 9\n  relative_file_paths:\n{listed}\n')
    return path


def file_of(folder):
    """Return the only file with messages in a folder."""
    [file] = [file for file in folder.iterdir() if file.name != 'metadata.yaml']
    return file
