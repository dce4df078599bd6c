# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The wire reader against rclpy's own serialization; test/core/test_wire.py has the rest."""

import itertools
import random
import struct

from inputs import for_each
from rclpy.serialization import serialize_message
from ros_helpers import transform
from serialized import serialize
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.messages.wire import read, WireReader
from tf_tree_py.ros.messages.convert import as_sample, transform_stamped

NAMES = [*('p' * length for length in range(9)), 'ab', 'ba', 'Küche', '机器人', '🤖', 'a b\tc\n',
         '/slash', 'é' * 50, 'frame_' + 'abcdefghij' * 3]
ODD_NUMBERS = [float('nan'), float('inf'), 5e-324, -0.0, 1.7e308]


def serialized(*transforms):
    return serialize_message(TFMessage(transforms=transforms))


def in_bits(samples):
    return [(*sample[:3], struct.pack('7d', *sample.pose)) for sample in samples]


def check(reader, *transforms):
    """Read what rclpy writes, and what a machine with the other byte order would."""
    samples = [as_sample(message) for message in transforms]
    other_order = serialize([(parent, child, *divmod(stamp, 10**9), pose)
                             for parent, child, stamp, pose in samples], '>')
    for data in (serialized(*transforms), other_order):
        for read_it in (read, reader.read):
            assert in_bits(read_it(data).samples()) == in_bits(samples)


@for_each(count=[0, 1, 2, 3, 100, 1000])
def test_any_number_of_any_transforms_is_read(count):
    chance = random.Random(count)
    check(WireReader(), *[transform_stamped(
        chance.choice(NAMES), chance.choice(NAMES),
        chance.randrange(-2**31, 2**31) * 10**9 + chance.randrange(10**9),
        [chance.choice([*ODD_NUMBERS, chance.uniform(-1e6, 1e6)]) for _ in range(7)])
        for _ in range(count)])


def test_one_reader_reads_all_pairs_of_names_in_turns():
    reader = WireReader()
    for turn, (parent, child) in enumerate(itertools.chain(
            *[itertools.product(NAMES, repeat=2)] * 2)):
        messages = [transform(parent, child, turn, x=turn / 7)] * (1 + turn % 3)
        check(reader, *messages, transform(child, 'c', x=2.5))
