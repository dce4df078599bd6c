# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Whether messages are inserted as a block or one by one only changes the time it takes.

The results are compared with a buffer into which every message was inserted by itself. The
number of calls shows how a message was inserted.
"""

import math
from zlib import crc32

from bags import as_cdr, as_ros1, random_pose, SECOND
from counting import calls
from effort import examples
from foxglove_messages import ENCODERS, HERE
from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.bag import Connection, Decoder, RecordedMessage
from tf_tree_py.bag.assembly import assembler as assembling
from tf_tree_py.bag.assembly.assembler import Assembler
from tf_tree_py.core import UNLIMITED
from tf_tree_py.core.buffer.intake import Intake
from tf_tree_py.core.messages.incidents import Incident
from tf_tree_py.core.tree.tree import Tree
from tf_tree_py.files.tree_file import saved_tree
from tf_tree_py.frame_names import rename

TF = Connection('/tf', 'tf2_msgs/msg/TFMessage', False, '')
OTHER = TF._replace(topic='/other/tf')
STATIC = TF._replace(topic='/tf_static', latched=True)
ROS1 = TF._replace(publisher='/old', encoding='ros1')
ONE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def arrival(connection, transforms, data=None):
    """
    Return a message; transforms are (parent, child, stamp), optionally with a pose.

    Without one, the pose is random, and depends on the message alone.
    """
    rng = np.random.default_rng(crc32(repr((connection, transforms)).encode()))
    transforms = [each if len(each) == 4 else (*each, random_pose(rng)) for each in transforms]
    if data is None:
        encode = as_ros1 if connection.ros1 else as_cdr
        if connection.has_foxglove_transforms:
            encode = ENCODERS[connection.encoding]
        data = encode(transforms)
    return RecordedMessage(0, connection, data)


def assembled(arrivals, cache_time=UNLIMITED, decoder=None):
    result = Assembler(decoder or Decoder(), cache_time)
    result.assemble(arrivals)
    return result


def fed(arrivals, cache_time=UNLIMITED, decoder=None):
    """Return a buffer into which the messages were inserted one after the other."""
    decoder, buffer = decoder or Decoder(), BufferCore(cache_time)
    for each in arrivals:
        batch = decoder.read(each)
        if isinstance(batch, Incident):
            buffer.intake.refuse(batch)
        else:
            buffer.insert_batch(batch, each.connection.authority, each.connection.static)
    return buffer


def assert_same(result, buffer):
    """Assert that both are equal in every byte, and in their counts."""
    ours, theirs = saved_tree(result.tree), saved_tree(buffer.intake.tree)
    assert ours.header == theirs.header
    assert ours.as_bytes() == theirs.as_bytes()
    assert result.intake.statistics() == buffer.statistics()


# --- how messages are inserted

def ways(arrivals, before=()):
    """Return how many messages were inserted singly, and how many edges as a block."""
    result = assembled(before)
    with calls() as of:
        result.assemble(arrivals)
        counted = of(Intake.insert_batch), of(Intake.insert_track)
    return counted


def stream(edges=(('map', 'odom'), ('odom', 'base')), begin=1, count=50, connection=TF):
    return [arrival(connection, [(*edge, (begin + number) * SECOND) for edge in edges])
            for number in range(count)]


def test_first_message_of_an_edge_is_inserted_in_order():
    assert ways(stream()) == (1, 2)


def test_several_publishers_in_turns_are_taken_together():
    odometry, arm = stream(count=30), stream([('base', 'hand')], count=30, connection=OTHER)
    mixed = [each for pair in zip(odometry, arm, strict=True) for each in pair]
    assert ways(mixed[2:], mixed[:2]) == (0, 3)


def test_late_and_repeated_samples_are_taken_together():
    late = [*stream(begin=10), *stream(begin=20), *stream(begin=5, count=2)]
    late[1:1] = stream(begin=3, count=1)
    assert ways(late[3:], late[:3]) == (0, 2)


def test_refused_numbers_are_judged_together():
    bad = [arrival(TF, [('map', 'odom', 7 * SECOND, (math.nan, *ONE[1:])),
                        ('odom', 'base', 7 * SECOND, (*ONE[:3], 0.0, 0.0, 0.0, 2.0))])]
    assert ways([*stream(begin=2), *bad], stream(count=1)) == (0, 2)


def test_messages_of_ros1_and_of_either_byte_order_are_taken_together():
    from serialized import serialize
    big = [arrival(TF, [], serialize([('map', 'odom', second, 0, ONE)], '>'))
           for second in range(1, 40)]
    assert ways(big[1:], big[:1]) == (0, 1)
    old = stream(connection=ROS1)
    assert ways(old[1:], old[:1]) == (0, 2)


@pytest.mark.parametrize('odd, careful', [
    (arrival(TF, [('odom', 'lidar', 30 * SECOND)]), 1),
    (arrival(TF, [('map', 'odom', SECOND // 2)]), 1),
    (arrival(STATIC, [('base', 'camera', 0)]), 1),
    # All later samples of a frame whose parent has changed.
    (arrival(TF, [('map', 'base', 30 * SECOND)]), 2),
    # Invalid messages are refused before both.
    (arrival(TF, [], b'\0\1\0\0 what is this?'), 0),
    (arrival(TF, [], b''), 0),
], ids=['new edge', 'older than all', 'static', 'other parent', 'unreadable', 'empty'])
def test_what_may_change_the_structure_is_taken_at_its_turn(odd, careful):
    before, after = stream(count=10), stream(begin=11)
    counted, _ = ways([*before[1:], odd, *after[:1]], before[:1])
    assert counted == careful
    assert_same(assembled([*before, odd, *after]), fed([*before, odd, *after]))


def test_static_message_that_is_sent_again_interrupts_nothing():
    static = [arrival(STATIC, [('base', 'camera', second * SECOND, ONE),
                               ('base', 'lidar', 0, (*ONE[:6], 2.0))]) for second in range(50)]
    messages = [each for pair in zip(static, stream(), strict=True) for each in pair]
    with calls() as of:
        assembled(messages)
        assert of(Intake.insert_track) == 2
        assert 0 < of(Tree.history_to_extend) < 9


def test_where_nothing_fits_looking_for_what_does_is_given_up_soon():
    """An edge that closes a loop is always refused; blocks are not tried at each message."""
    messages = [each for pair in zip(stream(count=400), stream(
        [('base', 'map')], count=400, connection=OTHER), strict=True) for each in pair]
    with calls() as of:
        result = assembled(messages)
        tried = of(Tree.history_to_extend)
    assert 0 < tried < 40
    assert_same(result, fed(messages))


# --- results

FRAMES = st.sampled_from(['a', 'b', 'c', 'd', '/e', ''])
POSES = st.one_of(
    st.integers(0, 2**32).map(lambda seed: random_pose(np.random.default_rng(seed))),
    st.sampled_from([ONE, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 2.0), (0.0,) * 7,
                     (math.inf, *ONE[1:]), (*ONE[:3], 1e-200, 0.0, 0.0, 0.0)]))
STAMPS = st.one_of(st.integers(0, 12), st.integers(0, 2000)).map(
    lambda tenth: tenth * SECOND // 10)
TRANSFORMS = st.lists(st.tuples(FRAMES, FRAMES, STAMPS, POSES), max_size=3)
CONNECTIONS = st.sampled_from([TF, TF, TF, OTHER, ROS1, STATIC, *HERE])


@st.composite
def recordings(draw):
    """Return messages, many of them from publishers with a regular sequence."""
    messages = []
    for _ in range(draw(st.integers(1, 6))):
        if draw(st.booleans()):
            messages += [arrival(draw(CONNECTIONS), draw(TRANSFORMS))
                         for _ in range(draw(st.integers(1, 4)))]
            continue
        on, begin = draw(CONNECTIONS), draw(st.integers(0, 40))
        edges = draw(st.lists(st.tuples(FRAMES, FRAMES), min_size=1, max_size=3))
        messages += [arrival(on, [(*edge, (begin + number) * SECOND // 10) for edge in edges])
                     for number in range(draw(st.integers(1, 30)))]
        if draw(st.integers(0, 5)) == 5:
            messages.append(arrival(TF, [], draw(st.binary(max_size=40))))
    return messages


@examples(3)
@given(recordings(), st.sampled_from([UNLIMITED, SECOND]), st.sampled_from([1, 700, 10**6]))
def test_tree_is_the_one_that_a_buffer_has_which_was_fed(messages, cache_time, window_bytes):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assembling, 'WINDOW_BYTES', window_bytes)
        result = assembled(messages, cache_time)
    assert_same(result, fed(messages, cache_time))


def test_a_window_ends_with_the_message_that_exceeds_its_bytes(monkeypatch):
    messages, counts = stream(count=25), []
    monkeypatch.setattr(assembling, 'WINDOW_BYTES', 9 * len(messages[0].data))
    Assembler(Decoder(), UNLIMITED).assemble(messages, counts.append)
    assert counts == [10, 10, 5]


def test_many_layouts_of_one_size_are_all_read():
    messages = [arrival(TF, [('map', f'frame{number % 60:02}', SECOND + number)])
                for number in range(600)]
    assert_same(assembled(messages), fed(messages))


def test_edges_that_are_left_out_leave_no_trace():
    decoder = Decoder(lambda connection: rename(frame_filter=['odom', 'base']))
    again = Decoder(lambda connection: rename(frame_filter=['odom', 'base']))
    messages = stream()
    assert_same(assembled(messages, decoder=decoder), fed(messages, decoder=again))


# --- reports

def told(arrivals):
    return {(oddity.reason, oddity.child): oddity for oddity in
            assembled(arrivals).oddities.summed()}


def test_stamps_that_do_not_go_on_are_told_by_edge_and_counted():
    messages = stream(begin=10) + stream([('map', 'odom')], begin=59, count=1)
    messages += stream([('map', 'odom')], begin=5, count=20)
    messages += [arrival(TF, [('map', 'odom', 24 * SECOND - SECOND // 2)])]
    odd = told(messages)
    assert {key: oddity.times for key, oddity in odd.items()} == {
        ('repeated stamp', 'odom'): 1, ('jump back', 'odom'): 1, ('out of order', 'odom'): 1}
    assert odd['jump back', 'odom'].detail == (
        '5.000000000 arrived after 59.000000000, which is 54.000 s newer')


@pytest.mark.parametrize(('back', 'reason'), [
    (1, 'out of order'), (SECOND, 'out of order'), (SECOND + 1, 'jump back')])
def test_step_back_of_more_than_a_second_is_a_jump(back, reason):
    stamp = 10 * SECOND - back
    (odd,) = told([arrival(TF, [('map', 'odom', each)]) for each in (10 * SECOND, stamp)]).values()
    assert (odd.reason, odd.first, odd.last, odd.times) == (reason, stamp, stamp, 1)


def test_oddities_are_told_with_the_oldest_and_the_newest_stamp_the_most_frequent_first():
    half = SECOND // 2
    odd = told([arrival(TF, [('map', 'odom', number * half)])
                for number in (40, 20, 30, 29, 9, 8, 60, 59)])
    assert [(each.reason, each.first, each.last, each.times) for each in odd.values()] == [
        ('out of order', 8 * half, 59 * half, 3), ('jump back', 9 * half, 20 * half, 2)]
    assert str(odd['out of order', 'odom']).startswith(
        "out of order 'map' -> 'odom': 3 times, from 4.000000000 to 29.500000000 s: 14.5")


def test_refused_samples_are_told_with_the_oldest_and_the_newest_stamp():
    odd = told([arrival(TF, [('map', 'odom', second * SECOND, (0.0,) * 7)])
                for second in (4, 2, 6)])['all-zero quaternion', 'odom']
    assert (odd.first, odd.last, odd.times) == (2 * SECOND, 6 * SECOND, 3)


def test_static_edge_with_another_value_is_told_with_both():
    odd = told([arrival(STATIC, [('base', 'camera', 0, ONE)])] * 3
               + [arrival(STATIC, [('base', 'camera', 0, (0.5, *ONE[1:]))]),
                  arrival(STATIC, [('base', 'camera', 0, (0.5, *ONE[1:6], 2.0))])])
    oddity = odd['static edge sent again with another value', 'camera']
    assert oddity.times == 1
    assert "it was (0, 0, 0, 0, 0, 0, 1) below 'base', and is now (0.5, " in oddity.detail


def test_thousands_of_refused_samples_are_one_line():
    odd = told([*stream(count=1), *(arrival(TF, [('map', 'odom', SECOND, (0.0,) * 7)])
                                    for _ in range(3_000))])
    assert odd['all-zero quaternion', 'odom'].times == 3_000
    assert len(odd) == 2
