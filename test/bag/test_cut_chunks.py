# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Of a file that ends within a chunk, all messages before that are read, and the rest counts."""

import re

from bags import as_cdr, as_ros1, driving, file_of, write_mcap, write_ros1, write_ros2
from effort import examples
from hypothesis import given, strategies as st
import lz4.frame
import pytest
from rosbags.rosbag1 import writer as rosbag1_writer
from tf_tree_py.bag.files.mcap_scan import McapScan
from tf_tree_py.bag.files.ros1_scan import Ros1Scan
from tf_tree_py.bag.files.unpacking import unpacked_block, unpacked_part

RUN = driving(count=1_000)
PARTS = (0.05, 0.1, 0.3, 0.45, 0.6, 0.6001, 0.7)


def lost_bytes(words):
    """Return the numbers in the words about what is lost: bytes in the file, and behind it."""
    lost = re.search(r'and ([0-9,]+) of its', words)
    more = re.search(r'at least ([0-9,]+) more', words)
    return [int(found[1].replace(',', '')) if found else 0 for found in (lost, more)]


def cut(path, part):
    """Write the first part of a file beside it; return that file."""
    data = path.read_bytes()
    other = path.with_stem('cut')
    other.write_bytes(data[:int(part * len(data))])
    return other


def one_chunk(path, compression):
    """Write a file of MCAP whose messages are in one chunk."""
    mcap = pytest.importorskip('mcap.writer')
    with path.open('wb') as file:
        writer = mcap.Writer(file, chunk_size=2**30, enable_crcs=True,
                             compression=mcap.CompressionType[compression.upper()])
        writer.start('ros2', 'test')
        channel = writer.register_channel('/tf', 'cdr', writer.register_schema(
            'tf2_msgs/msg/TFMessage', 'ros2msg', b''))
        for message in RUN:
            writer.add_message(channel, message.received, as_cdr(message.transforms),
                               message.received)
        writer.finish()
    return path


def one_block(path):
    """Write a bag of ROS 1 with lz4 like its own programs: a chunk is one block."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rosbag1_writer, 'lz4_compress', lambda data, level: lz4.frame.compress(
            data, level, block_size=lz4.frame.BLOCKSIZE_MAX1MB))
        return write_ros1(path, RUN, 'lz4')


# How each kind is written.
PLAIN = {
    'mcap': lambda path: file_of(write_ros2(path, RUN)),
    'mcap, one chunk': lambda path: one_chunk(path.with_suffix('.mcap'), 'none'),
    'ros1': lambda path: write_ros1(path.with_suffix('.bag'), RUN),
}
PACKED = {
    'mcap, zstd': lambda path: file_of(write_ros2(path, RUN, compression='storage')),
    'mcap, one chunk of zstd': lambda path: one_chunk(path.with_suffix('.mcap'), 'zstd'),
    'mcap, one chunk of lz4': lambda path: one_chunk(path.with_suffix('.mcap'), 'lz4'),
    'ros1, lz4': lambda path: write_ros1(path.with_suffix('.bag'), RUN, 'lz4'),
    'ros1, one block of lz4': lambda path: one_block(path.with_suffix('.bag')),
    'ros1, bz2': lambda path: write_ros1(path.with_suffix('.bag'), RUN, 'bz2'),
}


def scanned(path):
    """Return the messages of a file, as they were written, and the words about what is lost."""
    scan = (Ros1Scan if path.suffix == '.bag' else McapScan)(path)
    data = [arrival.data for arrival in scan]
    written = map(as_ros1 if path.suffix == '.bag' else as_cdr,
                  (message.transforms for message in RUN))
    assert data == [each for each, _ in zip(written, data, strict=False)]
    return data, scan.lost


@pytest.mark.parametrize('form', PLAIN)
@pytest.mark.parametrize('part', PARTS)
def test_every_message_before_the_cut_is_read(tmp_path, form, part):
    whole = PLAIN[form](tmp_path / 'run')
    file = cut(whole, part)
    data, words = scanned(file)
    there, serialize = file.read_bytes(), as_ros1 if file.suffix == '.bag' else as_cdr
    assert len(data) == sum(serialize(message.transforms) in there for message in RUN)
    lost, more = lost_bytes(words)
    assert lost < 1_000 and more <= len(whole.read_bytes()) - len(there)


def assert_adds_up(whole, file, data, words):
    """Assert that the bytes that are said to be lost gave no message, and the others did."""
    lost, more = lost_bytes(words)
    size = file.stat().st_size
    assert more <= whole.stat().st_size - size
    for fewer, is_same in ((lost - 600, True), (lost + 3_000, False)):
        shorter, _ = scanned(cut(whole, (size - max(0, fewer)) / whole.stat().st_size))
        assert (len(shorter) == len(data)) == is_same or not data


@pytest.mark.parametrize('form', PACKED)
@pytest.mark.parametrize('part', PARTS)
def test_messages_and_lost_bytes_of_a_compressed_file_add_up(tmp_path, form, part):
    whole = PACKED[form](tmp_path / 'run')
    file = cut(whole, part)
    data, words = scanned(file)
    if 'lz4' in form:
        assert lost_bytes(words)[0] < 1_000 and len(data) > (part - 0.05) * len(RUN)
    assert_adds_up(whole, file, data, words)


# --- lz4

@examples(2)
@given(data=st.lists(st.sampled_from([b'a', b'ab', b'transforms', b'\0' * 300, bytes(range(256))]),
                     max_size=300).map(b''.join),
       part=st.floats(0, 1), linked=st.booleans(), sums=st.booleans(), sized=st.booleans())
def test_block_of_lz4_that_is_cut_gives_the_begin_of_what_was_packed(
        data, part, linked, sums, sized):
    packed = lz4.frame.compress(data, block_linked=linked, block_checksum=sums,
                                content_checksum=sums, store_size=sized)
    unpacked, used = unpacked_part('lz4', memoryview(packed[:int(part * len(packed))]))
    assert data.startswith(bytes(unpacked)) and used <= len(packed)
    assert part < 1 or bytes(unpacked) == data


@pytest.mark.parametrize('options', [
    {'block_linked': False}, {'block_checksum': True}, {'store_size': False}])
@pytest.mark.parametrize('part', PARTS)
def test_last_of_many_blocks_of_lz4_is_found(options, part):
    data = b''.join(as_cdr(message.transforms) for message in RUN)
    packed = lz4.frame.compress(data, **options)
    size = int(part * len(packed))
    unpacked, used = unpacked_part('lz4', memoryview(packed[:size]))
    assert data.startswith(bytes(unpacked)) and used == size
    assert len(unpacked) > 0.9 * part * len(data)


@examples(2)
@given(block=st.binary(max_size=100))
def test_block_of_lz4_that_is_damaged_gives_what_it_says(block):
    assert len(unpacked_block(memoryview(block), b'before')) < 2**15


def test_block_of_lz4_cannot_take_much_memory():
    assert len(unpacked_block(memoryview(b'\x1fa\1\0' + b'\xff' * 2**20 + b'\0'), b'')) <= 2**23


# --- topics

def test_messages_behind_a_damaged_chunk_have_their_topics(tmp_path):
    """The chunk with the description of a topic is damaged; the index has it, too."""
    file = write_ros1(tmp_path / 'run.bag', RUN * 5, 'bz2')
    data = bytearray(file.read_bytes())
    first = data.index(b'BZh9')
    assert data.index(b'BZh9', first + 1)
    data[first + 100:first + 200] = bytes(100)
    file.write_bytes(data)
    scan = Ros1Scan(file)
    given = [arrival.data for arrival in scan]
    assert 0.3 * len(RUN * 5) < len(given) < len(RUN * 5)
    assert lost_bytes(scan.lost)[0] > 10_000


@pytest.mark.parametrize('form', ['mcap', 'ros1'])
def test_messages_without_a_topic_count_as_lost(tmp_path, form):
    file = PLAIN[form](tmp_path / 'run')
    data = bytearray(file.read_bytes())
    if form == 'mcap':
        data = data[:data.rindex(b'\x0f', 0, data.rindex(b'rosbag2'))]
        place = data.index(b'\x04', data.index(b'tf2_msgs/msg/TFMessage') + 22)
        data[place] = 0x70
    else:
        data = data.replace(b'op=\7', b'op=\x11')  # no connection
    file.write_bytes(data)
    scan = (Ros1Scan if form == 'ros1' else McapScan)(file)
    assert len(list(scan)) < len(RUN)
    assert lost_bytes(scan.lost)[0] > 0.5 * len(data)


@pytest.mark.parametrize('form', ['mcap', 'ros1'])
def test_length_that_is_damaged_within_a_whole_chunk_claims_nothing_behind_it(tmp_path, form):
    if form == 'mcap':
        file, before = write_mcap(tmp_path / 'run.mcap', RUN[:50], 'none'), 2 + 4 + 8 + 8 + 8
    else:
        file, before = write_ros1(tmp_path / 'run.bag', RUN[:50]), 4
    data = bytearray(file.read_bytes())
    serialize = as_ros1 if form == 'ros1' else as_cdr
    place = data.index(serialize(RUN[20].transforms)) - before
    data[place + 3] = 0x7f
    file.write_bytes(data)
    scan = (Ros1Scan if form == 'ros1' else McapScan)(file)
    assert len(list(scan)) >= 20
    lost, more = lost_bytes(scan.lost)
    assert 100 < lost < len(data) and not more
