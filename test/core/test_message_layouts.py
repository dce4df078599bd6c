# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The layouts of messages: what they are made of, what they read, and which are kept."""

import struct

import pytest
from serialized import serialize
from tf_tree_py.core import InvalidArgumentException, LATEST
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.message_layout import (
    as_published,
    find_layout,
    find_layout_in_steps,
    key_of,
)
from tf_tree_py.core.messages.sample import Batch, Edges, ImpossibleStamp, Sample
from tf_tree_py.core.messages.wire import read, WireReader, WireWriter, write

POSES = [(float(number), -2.0, 3.0, 0.5, 0.5, -0.5, 0.5) for number in range(4)]
FOUR = [('/map', 'odom', 1, 2, POSES[0]), ('odom', '/base', -3, 999_999_999, POSES[1]),
        ('base', 'leg', 4, 5, POSES[2]), ('/map', '/base', 6, 7, POSES[3])]


def one(parent='map', child='odom', sec=1, nanosec=2, pose=POSES[0], order='<'):
    return serialize([(parent, child, sec, nanosec, pose)], order)


def no_legs(parent, child):
    return None if child == 'leg' else (f'r/{parent}', f'r/{child}')


# --- what a layout is made of

@pytest.mark.parametrize(('data', 'name'), [
    (b'', b''), (bytes(16), b''), (bytes(17), b''), (bytes([2] * 20), b''),
    (bytes([2] * 21), b'\2'),
    (bytes([2] * 22), b'\2\2'), (bytes([2] * 30), b'\2\2'), (bytes(16) + b'\3abcdefgh', b'def'),
    (bytes(16) + b'\0abcdefgh', b'')])
def test_key_is_the_size_and_the_first_name(data, name):
    assert key_of(data) == (len(data), name)


def test_layout_knows_all_positions_of_a_message():
    data = serialize(FOUR[:3])
    layout = find_layout(data, no_legs)
    assert layout.key == (len(data), b'/map\0')
    assert layout.edges == (('r//map', 'r/odom'), ('r/odom', 'r//base'))
    # By hand: numbers begin at multiples of 4, poses of 8, both counted from byte 4.
    assert [tuple(place) for place in layout.wanted] == [
        (8, slice(16, 25), slice(28, 37), 44),
        (100, slice(108, 117), slice(120, 130), 132)]
    assert layout.fixed == [
        slice(0, 8), slice(16, 25), slice(28, 37), slice(108, 117), slice(120, 130),
        slice(196, 205), slice(208, 216)]
    assert layout.names == tuple(data[part] for part in layout.fixed)
    assert (layout.order, layout.stamp) == ('<', 'iI')
    # 500 for the layout and for each of three transforms; 5 for each byte of the head, of six
    # names with their lengths, and of the two names with slashes once more.
    assert layout.size == 500 * 4 + 5 * (8 + 9 + 9 + 9 + 10 + 9 + 8 + 4 + 5)


def test_layout_of_nothing_reads_nothing():
    layout = find_layout(serialize([]), as_published)
    assert (layout.wanted, layout.fixed, layout.size) == ([], [slice(0, 8)], 540)
    assert layout.read(serialize([])) == Batch((), (), (), ())


@pytest.mark.parametrize('order', ['<', '>'])
def test_layout_reads_all_messages_with_its_names(order):
    layout = find_layout(serialize(FOUR, order), no_legs)
    edges = [('r//map', 'r/odom'), ('r/odom', 'r//base'), ('r//map', 'r//base')]
    for times in ([(1, 2)] * 4, [(1, 2), (1, 3), (1, 2), (1, 2)], [(2, 2), (1, 2), (1, 2), (1, 2)],
                  [(-2**31, 0), (2**31 - 1, 999_999_999), (0, 0), (5, 5)]):
        message = [(parent, child, *time, pose) for (parent, child, *_, pose), time
                   in zip(FOUR, times, strict=True)]
        batch = layout.read(serialize(message, order))
        wanted = [each for each in message if each[1] != 'leg']
        assert batch == Batch(
            tuple(edges), [sec * 10**9 + nanosec for _, _, sec, nanosec, _ in wanted],
            tuple(pack_pose(*pose) for *_, pose in wanted) if order == '<'
            else [pack_pose(*pose) for *_, pose in wanted], ('/map', '/base'))
        assert batch.edges is layout.edges


@pytest.mark.parametrize(('place', 'fits'), [
    (0, False), (1, False), (3, False), (4, False), (7, False), (8, True), (15, True),
    (16, False), (23, False), (24, False), (31, False), (32, False), (36, True), (91, True)])
def test_layout_fits_messages_with_the_same_head_and_names(place, fits):
    data = bytearray(one())
    layout = find_layout(bytes(data), as_published)
    data[place] ^= 0x40
    assert layout.fits(bytes(data)) is fits
    assert (layout.read(bytes(data), static=True) is not None) is fits


@pytest.mark.parametrize(('nanosecs', 'bad'), [
    ([0, 0, 0, 0], []), ([999_999_999] * 4, []), ([10**9] * 4, [0, 1, 2, 3]),
    ([999_999_999, 10**9, 0, 2**32 - 1], [1, 3]), ([10**9, 0, 0, 0], [0])])
def test_transforms_with_impossible_stamps_are_left_out_unless_they_are_static(nanosecs, bad):
    data = serialize([(parent, child, 8, nanosec, pose) for (parent, child, *_, pose), nanosec
                      in zip(FOUR, nanosecs, strict=True)])
    edges = [('map', 'odom'), ('odom', 'base'), ('base', 'leg'), ('map', 'base')]
    stamps = [8 * 10**9 + nanosec for nanosec in nanosecs]
    poses = [pack_pose(*pose) for pose in POSES]
    static = WireReader(static=True)
    for batch in (static.read(data), static.read(data), static.read_known(data)):
        assert batch == Batch(tuple(edges), stamps, tuple(poses), ('/map', '/base'))
    good = [number for number in range(4) if number not in bad]
    reader = WireReader()
    layout = find_layout(data, as_published)
    for batch in (reader.read(data), reader.read(data), layout.read(data)):
        assert [list(column) for column in batch] == [
            [edges[number] for number in good], [stamps[number] for number in good],
            [poses[number] for number in good], ['/map', '/base'],
            [ImpossibleStamp(*edges[number], 8, nanosecs[number]) for number in bad]]


# --- bytes that are no message

SMALLEST = b'\0\1\0\0' + struct.pack('<I', 1)


@pytest.mark.parametrize(('data', 'error'), [
    (SMALLEST + bytes(63), '71 bytes cannot hold 1 transforms'),
    (SMALLEST + bytes(64), 'truncated at byte 28 of 72'),
    (SMALLEST + bytes(75), 'truncated at byte 28 of 83'),
    (SMALLEST + bytes(76 + 8), '8 bytes are left over after 1 transforms'),
    (serialize([]) + bytes(9), '9 bytes are left over after 0 transforms')])
def test_size_of_a_message_fits_its_count(data, error):
    for find in (find_layout, lambda *arguments: next(find_layout_in_steps(*arguments))):
        with pytest.raises(WireError) as raised:
            find(data, as_published)
        assert str(raised.value) == error


@pytest.mark.parametrize('padding', [0, 1, 7])
def test_smallest_message_may_be_padded(padding):
    batch = read(SMALLEST + bytes(76 + padding))
    assert batch.samples() == [Sample('', '', 0, (0.0,) * 7)]


@pytest.mark.parametrize(('count', 'steps'), [
    (0, 0), (498, 0), (499, 0), (500, 1), (999, 1), (1000, 2)])
def test_message_is_read_in_steps_of_500_transforms(count, steps):
    data = serialize([('a', 'b', 1, 2, POSES[0])] * count)
    assert len(list(find_layout_in_steps(data, as_published))) == steps


# --- which are kept

def test_reader_finds_the_layout_of_a_message_again():
    reader = WireReader(no_legs)
    first, other = one(child='arm1'), one(child='arm2')
    layouts = [reader.layout_of(data) for data in (first, other)]
    assert layouts[0].key == layouts[1].key
    assert [layout.edges for layout in layouts] == [(('r/map', 'r/arm1'),), (('r/map', 'r/arm2'),)]
    assert [reader.layout_of(data) for data in (first, other)] == layouts
    assert reader.remembered == sum(layout.size for layout in layouts)
    assert reader.read_known(other) == layouts[1].read(other)
    assert reader.read_known(one(child='arm3')) is None
    with pytest.raises(WireError, match='not CDR'):
        reader.layout_of(b'')


def test_names_take_eight_megabytes_by_default():
    # 500 each for the layout and its transform, 5 for each byte: 8 of the head, 8 of the lengths.
    longest = (8_000_000 - 1000) // 5 - 8 - 8 - 1
    for length, remembered in ((longest - 1, 8_000_000), (longest, 0)):
        reader = WireReader()
        reader.read(one('', 'x' * length))
        assert reader.remembered == remembered
    assert reader.read_known(one('', 'x' * longest)) is None


def test_message_that_cannot_be_read_is_refused():
    refused = Incident(Kind.MALFORMED, '', '', LATEST, 'me', 'truncated at byte 28 of 72')
    data = SMALLEST + bytes(64)
    assert WireReader().read_or_refuse(data, 'me') == refused
    with pytest.raises(StopIteration) as end:
        next(WireReader().read_in_steps(data, 'me'))
    assert end.value.value == refused
    assert WireReader().read_or_refuse(one(), 'me') == read(one())


# --- writing

def test_writer_writes_what_the_batch_says():
    writer = WireWriter()
    for parent, child in (('map', 'odom'), ('map', 'base'), ('map', 'odom')):
        for stamp in (0, -1, 5 * 10**9 + 7, (2**31 - 1) * 10**9 + 2**32 - 1):
            edges = Edges([(parent, child), ('base', 'leg')])
            poses = [pack_pose(*pose) for pose in POSES[:2]]
            batch = Batch(edges, [stamp, 3], poses)
            data = writer.write(batch)
            assert data == write(batch.samples())
    assert read(writer.write(Batch([('', '')], [9], [pack_pose(*POSES[1])]))).samples() == [
        Sample('', '', 9, POSES[1])]


@pytest.mark.parametrize('stamp', [-2**31 * 10**9 - 1, (2**31 - 1) * 10**9 + 2**32])
def test_stamp_that_no_message_can_hold_is_not_written(stamp):
    sample = Sample('a', 'b', stamp, POSES[0])
    for call in (lambda: write([sample]), lambda: WireWriter().write(
            Batch([('a', 'b')], [stamp], [pack_pose(*POSES[0])]))):
        with pytest.raises(InvalidArgumentException, match='no message can hold it'):
            call()
