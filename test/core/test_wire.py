# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
TFMessages in bytes, sound ones and any others.

FUZZ_MESSAGES=1000000 fuzzes as many; a run of the tests has a few thousand.
"""

import os
import random

from hypothesis import example, given, strategies as st
import pytest
from serialized import serialize
from tf_tree_py import BufferCore
from tf_tree_py.core import TransformException
from tf_tree_py.core.buffer import intake
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.messages.message_layout import STEP
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import read, WireError, WireReader, WireWriter, write

FUZZ_MESSAGES = int(os.environ.get('FUZZ_MESSAGES', '6000'))

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
MOVED = (1.0, -2.0, 3.0, 0.5, 0.5, -0.5, 0.5)


def as_transforms(batch):
    return [(parent, child, stamp // 10**9, stamp % 10**9, pose)
            for parent, child, stamp, pose in batch.samples()]


names = st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs']), max_size=12)
transforms = st.tuples(
    names, names, st.integers(-2**31, 2**31 - 1), st.integers(0, 10**9 - 1),
    st.tuples(*[st.floats(allow_nan=False)] * 7))
# Enough to use both ways of storing poses.
messages = st.lists(transforms, max_size=12)


def without_slashes(message):
    return [(parent.removeprefix('/'), child.removeprefix('/'), *rest)
            for parent, child, *rest in message]


@given(messages, st.sampled_from('<>'))
@example([('/map', '//odom', 1, 2, MOVED)], '<')
def test_message_is_read_as_it_was_written_but_for_leading_slashes(message, order):
    assert as_transforms(read(serialize(message, order))) == without_slashes(message)


@given(st.lists(messages, min_size=2, max_size=6))
def test_reader_that_remembers_reads_as_one_that_does_not(several):
    reader = WireReader()
    for message in several * 2:
        assert as_transforms(reader.read(serialize(message))) == without_slashes(message)


@given(st.lists(messages, min_size=1, max_size=6))
def test_writer_that_remembers_writes_as_one_that_does_not(several):
    writer = WireWriter()
    for message in several * 2:
        batch = read(serialize(message))
        assert writer.write(batch) == write(batch.samples())


def test_layout_of_the_same_length_is_told_apart_by_any_name():
    reader = WireReader()
    for parent, child in [('map', 'odom'), ('map', 'base'), ('mop', 'odom'), ('map', 'odom')]:
        for second in ('a', 'b'):
            message = [(parent, child, 1, 2, MOVED), ('odom', second, 1, 2, MOVED)]
            assert as_transforms(reader.read(serialize(message))) == message


def test_padding_may_hold_anything():
    reader = WireReader()
    message = [('ab', 'abcd', 1, 2, MOVED)]
    data = bytearray(serialize(message))
    assert as_transforms(reader.read(bytes(data))) == message
    remembered = reader.remembered
    # The byte after 'ab\0', before the next multiple of four.
    assert data[23] == 0
    data[23] = 0xA5
    assert as_transforms(reader.read(bytes(data))) == message
    assert reader.remembered == remembered


def test_ever_new_names_do_not_fill_the_memory():
    reader = WireReader()
    sent = [serialize([(f'map{number}', f'frame{i}', 1, 2, IDENTITY) for i in range(200)])
            for number in range(150)]
    for data in sent:
        reader.read(data)
    assert 0 < 200 * sum(reader.read_known(data) is not None for data in sent) <= 10_200


def test_ever_new_names_of_one_length_do_not_make_the_search_long():
    reader = WireReader()
    sent = [serialize([('map', f'frame{number:05}', 1, 2, IDENTITY)]) for number in range(1000)]
    for data in sent:
        assert write(reader.read(data).samples()) == data
    assert 0 < sum(reader.read_known(data) is not None for data in sent) <= 64


def size_of(data):
    """Return the bytes that the layout of a message takes."""
    reader = WireReader()
    reader.read(data)
    return reader.remembered


# How many layouts of one size have a place, and how many of 66 are known after each message.
@pytest.mark.parametrize(('places', 'known'), [
    (0.99, [0] * 66), (1, [1] * 66), (3, [1, 2, 3] * 22), (1000, [*range(1, 65), 1, 2])])
def test_reader_forgets_what_has_no_place_and_counts_the_rest(places, known):
    sent = [serialize([('map', f'frame{number:02}', 1, 2, IDENTITY)]) for number in range(66)]
    size = size_of(sent[0])
    reader, found = WireReader(most=int(places * size)), []
    for data in sent:
        reader.read(data)
        found.append(sum(reader.read_known(each) is not None for each in sent))
        assert reader.remembered == found[-1] * size
    assert found == known


@pytest.mark.parametrize(('data', 'problem'), [
    (b'', 'not CDR'),
    (b'\x00\x01', 'truncated at byte 4 of 2'),
    (b'\x00\x07\x00\x00\x00\x00\x00\x00', 'not CDR: it begins with the bytes 00 07 00 00'),
    (b'\x00\x01\x00\x00\xff\xff\xff\xff', '8 bytes cannot hold 4294967295 transforms'),
    (serialize([('map', 'odom', 1, 2, IDENTITY)])[:-1], 'cannot hold 1 transforms|truncated'),
    (serialize([('map', 'odom', 1, 2, IDENTITY)]) + bytes(8), '8 bytes are left over'),
    (serialize([('map', 'odom', 1, 2, IDENTITY)]).replace(b'map\0', b'maps'), 'end with NUL'),
    (serialize([('map', 'odom', 1, 2, IDENTITY)]).replace(b'map\0', b'm\xff\xff\0'), 'not UTF-8'),
    (serialize([('map', 'odom', 1, 2, IDENTITY)]).replace(b'\4\0\0\0map', b'\4\0\0\x7fmap'),
     'truncated'),
])
def test_what_is_no_message_is_an_error_that_says_why(data, problem):
    with pytest.raises(WireError, match=problem):
        read(data)


def test_a_message_of_nothing_is_sound():
    assert read(serialize([])).samples() == []


# --- skipping, renaming


def without_legs(parent, child):
    return None if child.startswith('leg') else (f'r/{parent}', f'r/{child}')


@given(messages, st.sampled_from('<>'), st.data())
def test_reader_that_passes_over_some_reads_the_others(message, order, data):
    left_out = {edge[:2] for edge in message if data.draw(st.booleans())}
    reader = WireReader(lambda *edge: None if edge in left_out else edge)
    wanted = [edge for edge in message if edge[:2] not in left_out]
    for _ in range(2):
        assert as_transforms(reader.read(serialize(message, order))) == wanted


def test_names_are_thought_about_once_a_layout():
    asked = []

    def rename(parent, child):
        asked.append((parent, child))
        return without_legs(parent, child)

    reader = WireReader(rename)
    message = [('map', 'base', 1, 2, MOVED), ('base', 'leg1', 1, 2, MOVED)]
    batches = [reader.read(serialize(message)) for _ in range(3)]
    assert asked == [('map', 'base'), ('base', 'leg1')]
    assert [batch.edges for batch in batches] == [(('r/map', 'r/base'),)] * 3
    assert batches[0].edges is batches[2].edges


def test_message_of_which_nothing_is_wanted_is_empty():
    reader = WireReader(without_legs)
    for count in (1, 12):
        message = [('base', f'leg{number}', 1, 2, MOVED) for number in range(count)]
        assert reader.read(serialize(message)).samples() == []


# --- writing


@given(messages)
def test_written_message_is_read_as_it_was(message):
    samples = [Sample(parent, child, sec * 10**9 + nanosec, pose)
               for parent, child, sec, nanosec, pose in message]
    assert write(samples) == serialize(message)


@given(st.integers(-2**31, 2**31 - 1), st.integers(0, 2**32 - 1))
def test_whatever_stamp_was_read_can_be_written(sec, nanosec):
    reader = WireReader(static=True)
    (sample,) = reader.read(serialize([('map', 'odom', sec, nanosec, MOVED)])).samples()
    assert reader.read(write([sample])).samples() == [sample]


# --- damaged messages


def mutated(rng, data):
    """Damage a message in one of the ways in which messages get damaged."""
    data = bytearray(data)
    damage = rng.randrange(5)
    if damage == 0:
        return bytes(data[:rng.randrange(len(data) + 1)])
    if damage == 1:
        return bytes(data) + rng.randbytes(rng.randrange(1, 20))
    if damage == 2:
        return rng.randbytes(rng.randrange(len(data)))
    for _ in range(rng.randrange(1, 8)):
        data[rng.randrange(len(data))] = rng.randrange(256)
    if damage == 3:
        data[:4] = b'\0\1\0\0'
    return bytes(data)


def outcome(read_message, data):
    """Return the content of a message, bit by bit, or that it is invalid."""
    try:
        batch = read_message(data)
    except WireError:
        return None
    return list(batch.edges), list(batch.stamps), b''.join(batch.poses)


def test_no_bytes_do_harm():
    rng = random.Random(20)
    reader = WireReader()
    buffer = BufferCore()
    odom, base = (('map', 'odom', 10, 7, MOVED), ('odom', 'base_link', 10, 7, MOVED))
    many = [odom, *(('odom', f'leg{number}', 10, 7, MOVED) for number in range(9))]
    sound = [serialize(message) for message in ([odom], [odom, base], [base], many)]
    buffer.insert_batch(read(sound[1]))
    for _ in range(FUZZ_MESSAGES):
        data = mutated(rng, rng.choice(sound))
        remembered = outcome(reader.read, data)
        assert remembered == outcome(read, data)
        if remembered is not None:
            buffer.insert_batch(read(data))
    assert_all_poses_are_sound(buffer)


def assert_all_poses_are_sound(buffer):
    for child, history in buffer.intake.tree.histories.items():
        for stamp in (history.oldest_stamp, history.latest_stamp):
            try:
                pose = buffer.lookup(history.parent, child, stamp)
            except TransformException:
                continue
            assert all(abs(number) < float('inf') for number in pose)
            assert sum(number * number for number in pose[3:]) == pytest.approx(1.0, abs=1e-9)


def test_messages_with_leading_slashes_take_the_short_way(monkeypatch):
    """Only the first has a closer look: the slashes are removed before the tree gets the names."""
    looked_at = []
    closely = intake.checked
    monkeypatch.setattr(intake, 'checked', lambda sample, authority: (
        looked_at.append(sample) or closely(sample, authority)))
    reader, buffer = WireReader(), BufferCore()
    for sec in range(1, 6):
        message = [('/map', '/odom', sec, 0, IDENTITY), ('/odom', 'base', sec, 0, IDENTITY)]
        assert not buffer.insert_batch(reader.read(serialize(message)))
    assert len(looked_at) == 2
    assert buffer.frames() == ['odom', 'map', 'base']
    assert [edge.samples for edge in buffer.edges()] == [5, 5]


# --- in steps

def steps_of(reader, data):
    """Read a message in steps; return how many there were, and the result."""
    steps, count = reader.read_in_steps(data, 'me'), 0
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return count, end.value
        count += 1


@given(messages)
def test_message_is_read_in_steps_as_in_one(message):
    data = serialize(message)
    assert steps_of(WireReader(), data) == (0, read(data))


def test_large_message_is_read_in_steps_and_then_known():
    message = [('map', f'frame{number}', 1, 2, MOVED) for number in range(4 * STEP)]
    reader, data = WireReader(), serialize(message)
    assert reader.read_known(data) is None
    count, batch = steps_of(reader, data)
    assert count == 4
    assert as_transforms(batch) == message
    assert reader.read_known(data) == batch
    assert steps_of(reader, data) == (0, batch)


def test_reader_reads_other_messages_between_two_steps():
    large, small = (serialize([('map', f'frame{number}', 1, 2, MOVED) for number in range(count)])
                    for count in (2 * STEP, 3))
    reader = WireReader()
    steps = reader.read_in_steps(large, 'me')
    for _ in steps:
        assert reader.read(small) == read(small)
        assert reader.read_known(large) is None
    assert reader.read_known(large) == read(large)


def test_what_is_no_message_is_refused_in_steps_as_at_once():
    whole = serialize([('map', f'frame{number}', 1, 2, MOVED) for number in range(2 * STEP)])
    for data in (b'', whole[:-9], whole + bytes(8), whole[:-80] + b'\xff' * 80):
        incident = WireReader().read_or_refuse(data, 'me')
        assert incident.kind is Kind.MALFORMED
        assert steps_of(WireReader(), data)[1] == incident


def test_parts_of_a_batch_are_the_batch():
    batch = read(serialize([('map', f'frame{number}', number, 2, MOVED) for number in range(10)]))
    for most, sizes in ((3, [3, 3, 3, 1]), (5, [5, 5]), (10, [10]), (11, [10])):
        parts = list(batch.parts(most))
        assert [len(part.edges) for part in parts] == sizes
        assert sum((part.samples() for part in parts), []) == batch.samples()
