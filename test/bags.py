# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Write bags of every kind with rosbags, with known content."""

from typing import NamedTuple

import numpy as np
import pytest
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag1 import Reader as Reader1, Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import get_typestore, Stores
from serialized import serialize, serialize_ros1
from tf_tree_py import BufferCore
from tf_tree_py.core import Sample, UNLIMITED

SECOND = 10**9
LATCHED = 'latched'
BEST_EFFORT = 'best effort'
UNKNOWN = 'unknown'
TF_MESSAGE = 'tf2_msgs/msg/TFMessage'

JAZZY = get_typestore(Stores.ROS2_JAZZY)
NOETIC = get_typestore(Stores.ROS1_NOETIC)
NOETIC.register(dict.fromkeys([TF_MESSAGE, 'tf/msg/tfMessage'], JAZZY.fielddefs[TF_MESSAGE]))


class Message(NamedTuple):
    """
    One message with transforms.

    :ivar received: nanoseconds.
    :ivar transforms: (parent, child, stamp in nanoseconds, pose) of each.
    :ivar qos: ``LATCHED``, ``BEST_EFFORT``, ``UNKNOWN`` or nothing.
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
    """Return a random pose within a metre, as plain floats."""
    pose = rng.normal(size=7)
    pose[3:] /= np.linalg.norm(pose[3:])
    return tuple(pose.tolist())


def as_cdr(transforms):
    return serialize([(parent, child, *divmod(stamp, SECOND), pose)
                      for parent, child, stamp, pose in transforms])


def as_ros1(transforms):
    return serialize_ros1([(parent, child, *divmod(stamp, SECOND), pose)
                           for parent, child, stamp, pose in transforms])


ODOMETRY = 'nav_msgs/msg/Odometry'
ESTIMATE = 'geometry_msgs/msg/PoseWithCovarianceStamped'


def estimate(topic, parent, child, stamp, pose, covariance, *, ros1=False, qos='', delay=0):
    """Return a message with a covariance: an Odometry, or a type without child if it has none."""
    store, type_name = NOETIC if ros1 else JAZZY, ODOMETRY if child else ESTIMATE
    made = store.types
    kinds = {name: made[f'geometry_msgs/msg/{name}'] for name in (
        'Point', 'Quaternion', 'Pose', 'PoseWithCovariance', 'Vector3', 'Twist',
        'TwistWithCovariance')}
    time = made['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
    header = made['std_msgs/msg/Header'](*([7] if ros1 else []), time, parent)
    uncertain = kinds['PoseWithCovariance'](
        kinds['Pose'](kinds['Point'](*pose[:3]), kinds['Quaternion'](*pose[3:])),
        np.ravel(covariance).astype(float))
    still = kinds['TwistWithCovariance'](
        kinds['Twist'](*[kinds['Vector3'](0.0, 0.0, 0.0)] * 2), np.full(36, 5.0))
    message = made[type_name](header, *([child, uncertain, still] if child else [uncertain]))
    data = (store.serialize_ros1 if ros1 else store.serialize_cdr)(message, type_name)
    return Message(stamp + delay, topic, [], qos, type_name=type_name, data=bytes(data))


def profile(qos):
    zero = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST, 10,
        QosReliability.BEST_EFFORT if qos == BEST_EFFORT else QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if qos == LATCHED else QosDurability.VOLATILE,
        zero, zero, QosLiveliness.AUTOMATIC, zero, False)


def write_ros2(path, messages, storage='mcap', compression=None):
    """Write a folder like rosbag2; return it."""
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
                    offered_qos_profiles=[] if message.qos == UNKNOWN else [
                        profile(message.qos)])
            data = as_cdr(message.transforms) if message.data is None else message.data
            writer.write(connections[key], message.received, data)
    return path


def write_mcap(path, messages, compression):
    """Write a file with one chunk for each message on /tf; return it; needs mcap."""
    mcap = pytest.importorskip('mcap.writer')
    with path.open('wb') as file:
        writer = mcap.Writer(file, chunk_size=1, enable_crcs=False,
                             compression=mcap.CompressionType[compression.upper()])
        writer.start('ros2', 'test')
        channel = writer.register_channel('/tf', 'cdr', writer.register_schema(
            'tf2_msgs/msg/TFMessage', 'ros2msg', b''))
        for message in messages:
            data = as_cdr(message.transforms) if message.data is None else message.data
            writer.add_message(channel, message.received, data, message.received)
        writer.finish()
    return path


def write_ros1(path, messages, compression=None):
    """Write a file like ROS 1; return it."""
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


def as_mcap(bag):
    """Write the messages of a ROS 1 bag as MCAP, like a converter; return the file; needs mcap."""
    mcap = pytest.importorskip('mcap.writer')
    with Reader1(bag) as reader, bag.with_suffix('.mcap').open('wb') as file:
        writer = mcap.Writer(file)
        writer.start('ros1', 'test')
        channels = {}
        for each in reader.connections:
            schema = writer.register_schema(
                each.msgtype.replace('/msg/', '/'), 'ros1msg', each.msgdef.data.encode())
            channels[each.id] = writer.register_channel(each.topic, 'ros1', schema, {
                'callerid': each.ext.callerid or '',
                'latching': 'true' if each.ext.latching else 'false'})
        for connection, stamp, data in reader.messages():
            writer.add_message(channels[connection.id], stamp, data, stamp)
        writer.finish()
    return bag.with_suffix('.mcap')


def write_split(path, parts, **options):
    """Write a bag of several files into one folder, like a recorder that splits bags."""
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


def without_index(path):
    """Truncate a bag as if its recorder had been killed: a recorder writes the index last."""
    data = path.read_bytes()
    if path.suffix == '.bag':
        data = data.replace(b'index_pos=' + data.partition(b'index_pos=')[2][:8],
                            b'index_pos=' + bytes(8), 1)
    else:
        data = data[:data.rindex(b'\x0c', 0, data.rindex(b'rosbag2'))]
    path.write_bytes(data)
    return path


# --- a recording, and its expected content

START = 1_700_000_000 * SECOND
PERIOD = SECOND // 50
RNG = np.random.default_rng(7)
STATIC = [Message(START + SECOND, '/tf_static', [
    ('base', 'lidar', 0, (0.1, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0)),
    ('base', 'camera', 0, (0.2, 0.0, 0.8, 0.5, 0.5, 0.5, 0.5))], LATCHED)]


def driving(prefix='', count=150, topic='/tf', publisher=''):
    """Return messages of a driving robot: odometry and an arm of two joints."""
    messages, rng = [], np.random.default_rng([7, *f'{prefix} {topic} {publisher}'.encode()])
    for number in range(count):
        stamp = START + number * PERIOD
        messages.append(Message(stamp + 5_000_000, topic, [
            ('map', f'{prefix}odom', stamp, random_pose(rng)),
            (f'{prefix}odom', f'{prefix}base', stamp, random_pose(rng))], publisher=publisher))
        messages.append(Message(stamp + 6_000_000, topic, [
            (f'{prefix}base', f'{prefix}hand', stamp + 1_000, random_pose(rng))],
            publisher=publisher))
    return messages


RUN = sorted(driving() + STATIC, key=lambda message: message.received)


def fed(messages, **options):
    """Return a buffer into which the messages were inserted one after the other."""
    buffer = BufferCore(UNLIMITED, **options)
    for message in messages:
        buffer.insert_many([Sample(*edge, stamp, pose) for *edge, stamp, pose
                            in message.transforms],
                           static=message.topic.endswith('_static') or message.qos == LATCHED,
                           strict=False)
    return buffer


def assert_same(a, b):
    """Assert that two buffers have the same edges, and the same poses between all frames."""
    assert [edge._replace(authority='') for edge in a.edges()] == [
        edge._replace(authority='') for edge in b.edges()]
    frames = b.frames()
    assert a.frames() == frames
    stamps = sorted({stamp + step for edge in b.edges() if not edge.static
                     for stamp in np.linspace(edge.oldest, edge.latest, 40).astype(int).tolist()
                     for step in (-1, 0, 1_000_003)})
    for frame in frames:
        for stamp in stamps:
            assert a.lookup_tree(frame, stamp) == b.lookup_tree(frame, stamp)


def missing_rows(words):
    """Return the number in the words about what is missing in a file of SQLite."""
    if words.endswith('and nothing is missing'):
        return 0
    return int(words.rsplit(' ', 2)[0].split(' ')[-1].replace(',', ''))
