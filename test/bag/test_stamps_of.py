# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The header stamps of any topic, from bags of both generations."""

from bags import as_mcap, file_of, JAZZY, NOETIC, RUN, SECOND, START, without_index, write_ros2
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer as Writer2
from tf_tree_py.bag import BagError, open_bag, stamps_of

STAMPS = [START + number * SECOND // 30 for number in range(40)]


def header(types, stamp):
    names = types.types
    time = names['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
    seq = {'seq': 5} if 'seq' in names['std_msgs/msg/Header'].__annotations__ else {}
    return names['std_msgs/msg/Header'](stamp=time, frame_id='camera', **seq)


def messages(types):
    """Return messages of a camera, a clock and a switch: (topic, type, stamp, message)."""
    names = types.types
    image, text = names['sensor_msgs/msg/Image'], names['std_msgs/msg/String']
    clock = names['rosgraph_msgs/msg/Clock']
    for stamp in STAMPS:
        head = header(types, stamp)
        yield '/image', image, stamp, image(header=head, height=1, width=2, encoding='mono8',
                                            is_bigendian=0, step=2, data=np.zeros(2, np.uint8))
        yield '/clock', clock, stamp, clock(clock=head.stamp)
        yield '/switch', text, stamp, text(data='on')


def write(path, storage):
    types = NOETIC if storage == 'ros1' else JAZZY
    if storage == 'ros1':
        path = path.with_suffix('.bag')
        writer = Writer1(path)
    else:
        writer = Writer2(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    with writer:
        topics = {}
        for topic, cls, stamp, message in messages(types):
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, cls.__msgtype__, typestore=types)
            data = (types.serialize_ros1 if storage == 'ros1' else types.serialize_cdr)(
                message, cls.__msgtype__)
            writer.write(topics[topic], stamp + 777, data)
    return path


@pytest.fixture(scope='module', params=['mcap', 'sqlite3', 'ros1', 'ros1 as mcap',
                                        'mcap without an index'])
def bag(request, tmp_path_factory):
    path = write(tmp_path_factory.mktemp('bag') / 'run', request.param.split()[0])
    if 'without' in request.param:
        return without_index(file_of(path))
    return as_mcap(path) if 'as mcap' in request.param else path


@pytest.mark.parametrize('topic', ['/image', '/clock'])
def test_stamps_are_those_of_the_messages(bag, topic):
    assert stamps_of(bag, topic).tolist() == STAMPS


def test_topic_without_a_header_and_one_that_is_not_there_are_told(bag):
    with pytest.raises(BagError, match='/switch .std_msgs/msg/String. begins with .*not with a h'):
        stamps_of(bag, '/switch')
    with pytest.raises(BagError, match='no topic /imgae; it has: /clock, /image, /switch'):
        stamps_of(bag, '/imgae')


def test_buffer_knows_its_bag(tmp_path):
    buffer = open_bag(write_ros2(tmp_path / 'run', RUN))
    with pytest.raises(BagError, match='/tf .*not with a header'):
        stamps_of(buffer, '/tf')
