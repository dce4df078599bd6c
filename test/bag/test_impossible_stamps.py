# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Moving transforms whose stamp has a second or more of nanoseconds are refused, and no others."""

from hypothesis import example, given, strategies as st
import pytest
from serialized import serialize, serialize_ros1
from tf_tree_py import BufferCore
from tf_tree_py.bag.assembly.decoding import MessageBlock
from tf_tree_py.bag.files.connections import find_ros1_layout
from tf_tree_py.core.messages.incidents import Kind
from tf_tree_py.core.messages.message_layout import find_layout
from tf_tree_py.core.messages.observers import Observer, ReceivedMessage
from tf_tree_py.core.messages.sample import Batch, ImpossibleStamp
from tf_tree_py.core.messages.wire import WireReader

SECOND = 10**9
ONE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

nanosecs = st.one_of(st.integers(0, SECOND - 1), st.integers(SECOND, 2**32 - 1),
                     st.sampled_from([0, SECOND - 1, SECOND, 2**32 - 1]))
stamps = st.lists(st.tuples(st.integers(0, 2**31 - 1), nanosecs), max_size=8)


class Heard(Observer):
    """Keeps what it is notified of."""

    def __init__(self):
        self.batches, self.incidents = [], []

    def received(self, arrival):
        self.batches.append(arrival.batch)

    def saw_incidents(self, incidents):
        self.incidents += incidents


def message(pairs):
    """Return the transforms of a message with these stamps, each of an edge of its own."""
    return [('map', f'child_{place}', *pair, ONE) for place, pair in enumerate(pairs)]


def parted(pairs):
    """Return the edges and stamps that are possible, and the stamps that are not."""
    edges = [(('map', f'child_{place}'), *pair) for place, pair in enumerate(pairs)]
    return ([(edge, sec * SECOND + nanosec) for edge, sec, nanosec in edges if nanosec < SECOND],
            [ImpossibleStamp(*edge, sec, nanosec) for edge, sec, nanosec in edges
             if nanosec >= SECOND])


@pytest.mark.parametrize(('write', 'find'), [
    (serialize, find_layout), (lambda made: serialize(made, '>'), find_layout),
    (serialize_ros1, find_ros1_layout)], ids=['little-endian', 'big-endian', 'ROS 1'])
def test_those_and_only_those_are_left_out_of_a_message(write, find):
    @given(stamps)
    @example([(1, SECOND)])
    @example([(1, SECOND - 1), (1, SECOND - 1)])
    @example([(1, SECOND), (1, SECOND)])
    def check(pairs):
        possible, impossible = parted(pairs)
        reader = WireReader(find=find)
        for batch in (reader.read(write(message(pairs))), reader.read(write(message(pairs)))):
            assert list(zip(batch.edges, batch.stamps, strict=True)) == possible
            assert len(batch.poses) == len(possible)
            assert list(batch.impossible) == impossible

    check()


@given(st.lists(stamps.filter(len), min_size=1, max_size=6))
def test_block_of_messages_has_the_possible_ones(several):
    data = [serialize(message((pairs * 3)[:3])) for pairs in several]
    layout = find_layout(data[0], lambda *edge: edge)
    fits, read, _ = MessageBlock(layout).read(data)
    batches = [layout.read(each) for each in data]
    assert fits.tolist() == [not batch.impossible for batch in batches]
    assert read.T.tolist() == [list(batch.stamps) for batch in batches if not batch.impossible]


@given(stamps)
def test_static_transforms_keep_whatever_they_have(pairs):
    batch = WireReader(static=True).read(serialize(message(pairs)))
    assert list(batch.stamps) == [sec * SECOND + nanosec for sec, nanosec in pairs]
    assert not batch.impossible


@given(stamps)
def test_buffer_takes_the_others_and_observers_learn_of_both(pairs):
    possible, impossible = parted(pairs)
    buffer, heard = BufferCore(), Heard()
    buffer.observers.add(heard)
    incidents = buffer.insert_batch(WireReader().read(serialize(message(pairs))), '/imu')
    assert incidents == heard.incidents == [stamp.incident('/imu') for stamp in impossible]
    assert {edge.child: edge.latest for edge in buffer.edges()} == {
        child: stamp for (_, child), stamp in possible}
    assert buffer.statistics().incidents[Kind.IMPOSSIBLE_STAMP] == len(impossible)
    assert buffer.statistics().accepted == len(possible)
    (batch,) = heard.batches
    assert (list(batch.edges), batch.impossible) == ([edge for edge, _ in possible], ())


def test_observers_of_a_message_that_was_announced_get_the_others_only():
    batch, heard = WireReader().read(serialize(message([(1, SECOND), (1, 5)]))), Heard()
    buffer = BufferCore()
    buffer.observers.add(heard)
    buffer.observers.notify_received(ReceivedMessage(batch, 0, '/tf'))
    buffer.insert_batch(batch, announced=True)
    ((edges, stamps, _, _, impossible),) = heard.batches
    assert (edges, stamps, impossible) == ([('map', 'child_1')], [SECOND + 5], ())
    assert len(heard.incidents) == 1


def test_incident_has_the_edge_the_sender_and_both_numbers():
    (incident,) = BufferCore().insert_batch(WireReader().read(serialize(
        [('/map', 'imu', 1_700_000_000, 2**32 - 1, ONE)])), '/driver')
    assert (incident.kind, incident.refused) == (Kind.IMPOSSIBLE_STAMP, True)
    assert (incident.parent, incident.child, incident.authority) == ('map', 'imu', '/driver')
    assert 'nanosec is 4294967295 (sec is 1700000000)' in incident.detail


@given(stamps, st.integers(1, 3))
def test_parts_of_a_batch_lose_none(pairs, most):
    whole = WireReader().read(serialize(message(pairs)))
    parts = list(whole.parts(most))
    assert [stamp for part in parts for stamp in part.impossible] == list(whole.impossible)
    assert [edge for part in parts for edge in part.edges] == list(whole.edges)


def test_batch_without_transforms_may_have_impossible_stamps():
    batch = Batch((), (), (), impossible=[ImpossibleStamp('map', 'imu', 1, SECOND)])
    buffer = BufferCore(clear_on_jump_back=SECOND)
    assert [each.kind for each in buffer.insert_batch(batch)] == [Kind.IMPOSSIBLE_STAMP]
    assert buffer.frames() == []
