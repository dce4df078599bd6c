# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The wire reader against rclpy's own serialization."""

import itertools
import random
import struct

import pytest
from rclpy.serialization import serialize_message
from ros_helpers import transform
from serialized import serialize
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.ingest.wire import read, WireError, WireReader
from tf_tree_py.ros.messages.convert import as_sample, transform_stamped


def serialized(*transforms):
    return serialize_message(TFMessage(transforms=transforms))


def samples(*transforms):
    return [as_sample(message) for message in transforms]


def random_transforms(seed, count):
    chance = random.Random(seed)
    name = 'frame_' + 'abcdefghij' * 3
    return [
        transform_stamped(
            name[:chance.randrange(30)], name[chance.randrange(30):],
            chance.randrange(-2**31, 2**31) * 1_000_000_000 + chance.randrange(1_000_000_000),
            tuple(chance.uniform(-1e6, 1e6) for _ in range(7)))
        for _ in range(count)
    ]


def big_endian(*transforms):
    """Return a message from a machine with the other byte order, which rclpy here cannot write."""
    return serialize([(parent, child, *divmod(stamp, 1_000_000_000), pose)
                      for parent, child, stamp, pose in samples(*transforms)], '>')


def test_names_of_every_length_are_read():
    for parent, child in itertools.product(range(9), repeat=2):
        messages = [transform('p' * parent, 'c' * child, x=1.5),
                    transform('p' * child, 'c', x=2.5)]
        assert read(serialized(*messages)).samples() == samples(*messages), (parent, child)


@pytest.mark.parametrize('count', [0, 1, 2, 3, 100, 1000])
def test_any_number_of_transforms_is_read(count):
    messages = random_transforms(count, count)
    assert read(serialized(*messages)).samples() == samples(*messages)


@pytest.mark.parametrize('name', ['Küche', '机器人', '🤖', 'a b\tc\n', '/slash', 'é' * 50])
def test_names_in_any_script_are_read(name):
    message = transform(name, name + '_x')
    assert read(serialized(message)).samples() == samples(message)


@pytest.mark.parametrize('number', [float('nan'), float('inf'), 5e-324, -0.0, 1.7e308])
def test_odd_numbers_are_read_bit_by_bit(number):
    (sample,) = read(serialized(transform('a', 'b', x=number))).samples()
    assert struct.pack('d', sample.pose[0]) == struct.pack('d', number)


def test_both_byte_orders_are_read_by_one_reader():
    reader = WireReader()
    for seed in range(20):
        messages = random_transforms(seed, 3)
        assert reader.read(serialized(*messages)).samples() == samples(*messages)
        assert reader.read(big_endian(*messages)).samples() == samples(*messages)


def test_alternating_publishers_are_kept_apart():
    reader = WireReader()
    publishers = [('map', 'odom'), ('odom', 'base'), ('base', 'left'), ('base', 'wing')]
    for turn in range(50):
        for parent, child in publishers:
            messages = [transform(parent, child, turn, x=turn / 7)] * (1 + turn % 3)
            assert reader.read(serialized(*messages)).samples() == samples(*messages)


def test_swapped_names_of_one_length_are_not_mixed_up():
    reader = WireReader()
    ab, ba = transform('aa', 'bb', x=1.0), transform('bb', 'aa', x=2.0)
    for messages in ([ab], [ba], [ab, ba], [ba, ab], [ab, ab], [ab], [ba, ba]):
        assert reader.read(serialized(*messages)).samples() == samples(*messages)


def test_padding_may_hold_anything():
    """Fast CDR leaves uninitialised memory there."""
    data = serialized(transform('map', 'base_link', x=1.5))
    gap = data.index(b'base_link\0') + len(b'base_link\0')
    reader = WireReader()
    for byte in (b'\0', b'\xaa', b'\xff'):
        padded = data[:gap] + byte * 2 + data[gap + 2:]
        assert reader.read(padded).samples() == samples(transform('map', 'base_link', x=1.5))
    assert sum(map(len, reader._layouts.values())) == 1


def test_thousands_of_changing_names_are_read():
    reader = WireReader()
    for i in range(3000):
        message = transform(f'parent_{i}', f'child_{i * 7}')
        assert reader.read(serialized(message)).samples() == samples(message)


def test_every_truncation_is_told():
    data = serialized(transform('map', 'odom'), transform('odom', 'base_link'))
    for size in range(len(data)):
        with pytest.raises(WireError):
            read(data[:size])


def test_trailing_bytes_are_told():
    with pytest.raises(WireError, match='24 bytes are left over after 1 transforms'):
        read(serialized(transform('a', 'b')) + bytes(24))


@pytest.mark.parametrize(('data', 'problem'), [
    (b'', 'not CDR'),
    (b'\x00\x02\x00\x00' + bytes(4), 'not CDR: it begins with the bytes 00 02'),
    (b'\x00\x01\x00\x00' + b'\xff' * 4, 'cannot hold 4294967295 transforms'),
    (b'junk that nobody can read', 'not CDR'),
])
def test_what_is_no_message_is_told(data, problem):
    with pytest.raises(WireError, match=problem):
        read(data)


def test_name_that_is_not_utf8_is_told():
    data = serialized(transform('map', 'odom')).replace(b'odom', b'o\xff\xfem')
    with pytest.raises(WireError, match=r"is not UTF-8: b'o\\xff\\xfem"):
        read(data)


def test_name_without_its_nul_is_told():
    data = serialized(transform('map', 'odom')).replace(b'map\0', b'maps')
    with pytest.raises(WireError, match='does not end with NUL'):
        read(data)


def test_damaged_bytes_raise_nothing_but_wire_errors():
    chance = random.Random(7)
    whole = serialized(transform('map', 'odom', x=1.0), transform('odom', 'base'))
    reader = WireReader()
    for _ in range(5000):
        data = bytearray(whole)
        for _ in range(chance.choice([1, 1, 2, 8])):
            data[chance.randrange(len(data))] = chance.randrange(256)
        try:
            reader.read(bytes(data))
        except WireError:
            continue
    assert reader.read(whole).samples() == read(whole).samples()
