"""A bag of any kind opens as a buffer that answers as one that was fed message by message."""

import warnings

from bags import (
    file_of,
    LATCHED,
    Message,
    random_pose,
    SECOND,
    write_ros1,
    write_ros2,
    write_split,
)
import numpy as np
import pytest
from tf_tree_py.bag import open_bag
from tf_tree_py.core import BufferCore, Sample, UNLIMITED

START = 1_700_000_000 * SECOND
PERIOD = SECOND // 50
RNG = np.random.default_rng(7)
STATIC = [Message(START + SECOND, '/tf_static', [
    ('base', 'lidar', 0, (0.1, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0)),
    ('base', 'camera', 0, (0.2, 0.0, 0.8, 0.5, 0.5, 0.5, 0.5))], LATCHED)]


def driving(prefix='', count=150, topic='/tf', publisher=''):
    """Return messages of a robot that drives: odometry and an arm of two joints."""
    messages = []
    for number in range(count):
        stamp = START + number * PERIOD
        messages.append(Message(stamp + 5_000_000, topic, [
            ('map', f'{prefix}odom', stamp, random_pose(RNG)),
            (f'{prefix}odom', f'{prefix}base', stamp, random_pose(RNG))], publisher=publisher))
        messages.append(Message(stamp + 6_000_000, topic, [
            (f'{prefix}base', f'{prefix}hand', stamp + 1_000, random_pose(RNG))],
            publisher=publisher))
    return messages


RUN = sorted(driving() + STATIC, key=lambda message: message.received)


def fed(messages, **options):
    """Return a buffer that took them one after the other."""
    buffer = BufferCore(UNLIMITED, **options)
    for message in messages:
        buffer.insert_many([Sample(*edge, stamp, pose) for *edge, stamp, pose
                            in message.transforms],
                           static=message.topic.endswith('_static') or message.qos == LATCHED,
                           strict=False)
    return buffer


def assert_same(a, b):
    """Hold two buffers to have the same edges, and the same answers between all frames."""
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


KINDS = {
    'mcap': lambda path: write_ros2(path, RUN),
    'sqlite3': lambda path: write_ros2(path, RUN, 'sqlite3'),
    'mcap, one file': lambda path: file_of(write_ros2(path, RUN)),
    'sqlite3, one file': lambda path: file_of(write_ros2(path, RUN, 'sqlite3')),
    'mcap, chunks compressed': lambda path: write_ros2(path, RUN, compression='storage'),
    'mcap, messages compressed': lambda path: write_ros2(path, RUN, compression='message'),
    'sqlite3, messages compressed':
        lambda path: write_ros2(path, RUN, 'sqlite3', compression='message'),
    'mcap, file compressed': lambda path: write_ros2(path, RUN, compression='file'),
    'sqlite3, file compressed, one file':
        lambda path: file_of(write_ros2(path, RUN, 'sqlite3', compression='file')),
    'mcap, split': lambda path: write_split(path, [RUN[:100], RUN[100:], []]),
    'sqlite3, split': lambda path: write_split(
        path, [RUN[begin:begin + 30] for begin in range(0, len(RUN), 30)], storage='sqlite3'),
    'ros1': lambda path: write_ros1(path.with_suffix('.bag'), RUN),
    'ros1, lz4': lambda path: write_ros1(path.with_suffix('.bag'), RUN, 'lz4'),
    'ros1, bz2': lambda path: write_ros1(path.with_suffix('.bag'), RUN, 'bz2'),
    'ros1, of the old tf': lambda path: write_ros1(
        path.with_suffix('.bag'),
        [message._replace(type_name='tf/msg/tfMessage') for message in RUN]),
}


@pytest.mark.parametrize('kind', KINDS)
def test_bag_of_any_kind_answers_as_a_buffer_that_was_fed(tmp_path, kind):
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        buffer = open_bag(KINDS[kind](tmp_path / 'run'))
    assert_same(buffer, fed(RUN))
    assert buffer.statistics.accepted == sum(len(message.transforms) for message in RUN)
