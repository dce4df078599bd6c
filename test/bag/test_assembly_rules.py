# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The parts of a bag's assembly by themselves: texts, blocks, names, the order of arrival."""

import math

from bags import as_cdr, SECOND
import numpy as np
import pytest
from serialized import serialize, serialize_ros1
from tf_tree_py.bag import Connection, Decoder, RecordedMessage
from tf_tree_py.bag.assembly.assembler import Anomalies, Anomaly, as_text, Assembler
from tf_tree_py.bag.assembly.decoding import decode, MessageBlock, prefixed, renames, Samples
from tf_tree_py.bag.assembly.lone_samples import ArrivalOrder
from tf_tree_py.bag.files.connections import find_ros1_layout
from tf_tree_py.core import Incident, Kind, LATEST, UNLIMITED
from tf_tree_py.core.messages.message_layout import as_published, find_layout
from tf_tree_py.core.messages.sample import SampleTrack

TF = Connection('/tf', 'tf2_msgs/msg/TFMessage', False, '')
STATIC = TF._replace(topic='/tf_static', latched=True)
ONE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def at(number):
    return (float(number), *ONE[1:])


def message(*transforms, connection=TF, received=0):
    """Return a message of (parent, child, stamp, pose)."""
    return RecordedMessage(received, connection, as_cdr(list(transforms)))


def assembled(*messages, decoder=None):
    result = Assembler(decoder or Decoder(), UNLIMITED)
    result.assemble(messages)
    return result


# --- anomalies

@pytest.mark.parametrize(('anomaly', 'text'), [
    (Anomaly('late', 'map', 'base', 1, 5 * SECOND, 5 * SECOND, 'so'),
     "late 'map' -> 'base': once, at 5.000000000 s: so"),
    (Anomaly('late', 'map', 'base', 2, 5 * SECOND, 6 * SECOND, 'so'),
     "late 'map' -> 'base': 2 times, from 5.000000000 to 6.000000000 s: so"),
    (Anomaly('late', '', 'base', 2, 5, 5, 'so'),
     "late '' -> 'base': 2 times, at 0.000000005 s: so"),
    (Anomaly('torn', '', '', 1, LATEST, LATEST, 'so'), 'torn: once: so'),
    (Anomaly('torn', '', '', 3, LATEST, 1, 'so'),
     'torn: 3 times, from 0.000000000 to 0.000000001 s: so')])
def test_anomaly_says_where_how_often_and_when(anomaly, text):
    assert str(anomaly) == text


def test_anomalies_of_one_reason_and_edge_are_summed():
    anomalies = Anomalies()
    assert anomalies.summed() == ()
    anomalies.note('torn', 'first')
    anomalies.note('late', 'one', ('map', 'base'), first=7)
    anomalies.note('late', 'two', ('map', 'base'), times=3, first=5, last=6)
    anomalies.note('late', 'three', ('map', 'base'), first=6, last=9)
    anomalies.note('late', 'four', ('map', 'arm'), first=8)
    anomalies.note_incidents([
        Incident(Kind.LOOP, 'base', 'map', 4, 'me', 'why'),
        Incident(Kind.LOOP, 'base', 'map', 2, 'me', 'why not')])
    assert anomalies.summed() == (
        Anomaly('late', 'map', 'base', 5, 5, 9, 'one'),
        Anomaly('would close a loop', 'base', 'map', 2, 2, 4, 'why'),
        Anomaly('torn', '', '', 1, LATEST, LATEST, 'first'),
        Anomaly('late', 'map', 'arm', 1, 8, 8, 'four'))


@pytest.mark.parametrize('count', [0, 1, 20, 21, 25])
def test_twenty_anomalies_are_shown(count):
    anomalies = [Anomaly('late', 'map', f'child{number}', 1, 5, 5, 'so')
                 for number in range(count)]
    more = [f'  and {count - 20} more, in the .oddities of the buffer'] * (count > 20)
    assert as_text('run.db3', anomalies).split('\n') == [
        'run.db3: readable, with anomalies:', *(f'  {each}' for each in anomalies[:20]), *more]


@pytest.mark.parametrize(('stamps', 'expected'), [
    ([5, 5], [('repeated stamp', 1, 5, 5, '0.000000005 twice in a row; lookups use the last '
               'sample')]),
    ([5, 6, 7], []), ([], []), ([5], []),
    ([9, 7, 8, 7], [('out of order', 2, 7, 7, '0.000000007 arrived after 0.000000009, which is 2 '
                     'ns newer')]),
    ([2 * SECOND, SECOND, SECOND], [
        ('out of order', 1, SECOND, SECOND, '1.000000000 arrived after 2.000000000, which is '
         '1.000 s newer'),
        ('repeated stamp', 1, SECOND, SECOND, '1.000000000 twice in a row; lookups use the last '
         'sample')]),
    ([2 * SECOND, SECOND - 1], [
        ('jump back', 1, SECOND - 1, SECOND - 1, '0.999999999 arrived after 2.000000000, which '
         'is 1.000 s newer')])])
@pytest.mark.parametrize('way', ['messages', 'track'])
def test_stamps_are_compared_with_the_ones_before(stamps, expected, way):
    if way == 'messages':
        result = assembled(*(message(('map', 'base', stamp, ONE)) for stamp in stamps))
    else:
        result = assembled()
        result.insert_track(SampleTrack('map', 'base', np.array(stamps, dtype=np.int64),
                                        np.array([ONE] * len(stamps)).reshape(-1, 7)), 'me')
    assert result.oddities.summed() == tuple(
        Anomaly(reason, 'map', 'base', *rest) for reason, *rest in expected)
    assert result.intake.statistics().accepted == len(stamps)


def test_refused_message_is_counted_and_noted():
    result = assembled()
    result.refuse(Incident(Kind.MALFORMED, '', '', LATEST, 'me', 'torn'))
    assert result.intake.statistics().refused == 1
    assert result.oddities.summed() == (
        Anomaly('malformed message', '', '', 1, LATEST, LATEST, 'torn'),)


@pytest.mark.parametrize(('size', 'counts'), [(16_000_000, [2]), (16_000_001, [1, 1])])
def test_window_is_full_beyond_sixteen_megabytes(size, counts):
    counted, torn = [], bytes(size)
    Assembler(Decoder(), UNLIMITED).assemble([RecordedMessage(0, TF, torn)] * 2, counted.append)
    assert counted == counts


# --- static edges

@pytest.mark.parametrize(('first', 'second', 'differ'), [
    (ONE, ONE, False), (ONE, (0.0,) * 6 + (3.0,), False), (ONE, at(1e-13), False),
    (ONE, at(1e-11), True), (at(1.0), at(1.0 + 1e-10), False), (at(1.0), at(1.0 + 1e-8), True),
    ((*ONE[:3], 0.6, 0.0, 0.0, 0.8), (*ONE[:3], 6.0, 0.0, 0.0, 8.0), False),
    ((*ONE[:3], 0.6, 0.0, 0.0, 0.8), (*ONE[:3], 0.0, 6.0, 0.0, 8.0), True),
    ((*ONE[:3], 0.0, 0.6, 0.0, 0.8), (*ONE[:3], 0.0, 3.0, 0.0, 4.0), False),
    ((*ONE[:3], 0.0, 0.0, 0.6, 0.8), (*ONE[:3], 0.0, 0.0, 3.0, 4.0), False),
    (ONE, (0.0,) * 7, True), (ONE, (math.nan, *ONE[1:]), True)])
def test_static_edge_that_is_sent_again_is_compared(first, second, differ):
    result = assembled(message(('map', 'cam', 0, first), connection=STATIC),
                       message(('map', 'cam', 0, second), ('map', 'new', 0, ONE),
                               connection=STATIC))
    found = [each for each in result.oddities.summed() if each.reason.startswith('static')]
    assert [each[:6] for each in found] == [
        ('static edge sent again with another value', 'map', 'cam', 1, LATEST, LATEST)] * differ


def test_static_edge_with_another_parent_is_noted_with_both():
    result = assembled(message(('map', 'cam', 0, at(0.5)), connection=STATIC),
                       message(('odom', 'cam', 0, at(0.5)), connection=STATIC),
                       message(('odom', 'cam', 5, at(0.25))))
    (found,) = (each for each in result.oddities.summed() if each.reason.startswith('static'))
    assert found.detail == ("it was (0.5, 0, 0, 0, 0, 0, 1) below 'map', and is now "
                            '(0.5, 0, 0, 0, 0, 0, 1); lookups at any time use the last one')
    assert (found.parent, found.child) == ('odom', 'cam')


# --- many messages together

def test_samples_between_two_messages():
    samples = Samples(np.array([2, 2, 5, 7]), np.array([10, 11, 12, 13]), np.arange(4))
    for begin, end, stamps in ((0, 9, [10, 11, 12, 13]), (2, 5, [10, 11]), (3, 7, [12]),
                               (5, 8, [12, 13]), (3, 5, []), (8, 9, []), (0, 2, [])):
        some = samples.between(begin, end)
        assert some.stamps.tolist() == stamps
        assert some.messages.tolist() == [each for each in (2, 2, 5, 7) if begin <= each < end]
        assert (some.poses + 10).tolist() == stamps


@pytest.mark.parametrize('name', ['ROS 2', 'big-endian', 'ROS 1'])
@pytest.mark.parametrize('count', [1, 3, 4000])
def test_block_reads_as_each_message_by_itself(name, count):
    write, find = {'ROS 2': (serialize, find_layout),
                   'big-endian': (lambda made: serialize(made, '>'), find_layout),
                   'ROS 1': (serialize_ros1, find_ros1_layout)}[name]
    data = [write([('map', 'base' if number % 5 else 'foot', 2**31 - 1 - number, number,
                    at(number)), ('base', 'leg1', 3, 4, ONE),
                   ('base', 'arm1', 5, 10**9 if number % 7 == 1 else 6, at(-number))])
            for number in range(count, 0, -1)]
    layout = find(data[0], lambda *edge: None if edge[1] == 'leg1' else edge)
    fits, stamps, poses = MessageBlock(layout).read(data)
    batches = [layout.read(each) for each in data]
    good = [batch for batch in batches if batch is not None and not batch.impossible]
    assert fits.tolist() == [batch is not None and not batch.impossible for batch in batches]
    assert stamps.shape == (2, len(good))
    assert stamps.T.tolist() == [list(batch.stamps) for batch in good]
    assert poses.shape == (2, len(good), 7)
    assert poses.transpose(1, 0, 2).tolist() == [
        [list(sample.pose) for sample in batch.samples()] for batch in good]


def test_block_reads_messages_of_any_size():
    data = [serialize([('map', f'{"x" * 600_000}{letter}', 1, 2, at(3))]) for letter in 'aba']
    layout = find_layout(data[0], as_published)
    fits, stamps, poses = MessageBlock(layout).read(data)
    assert (fits.tolist(), stamps.tolist()) == ([True, False, True], [[SECOND + 2] * 2])
    assert poses.tolist() == [[list(at(3))] * 2]
    nothing = MessageBlock(find_layout(data[0], lambda *edge: None)).read(data)
    assert [each.shape for each in nothing] == [(3,), (0, 2), (0, 2, 7)]


def test_window_has_the_samples_of_each_edge_and_the_other_messages():
    arrivals = [message(('map', 'odom', 1, at(1)), ('map', 'base', 2, at(2)), received=10),
                message(('map', 'cam', 0, ONE), connection=STATIC, received=11),
                message(('map', 'odo2', 3, at(3)), ('map', 'base', 4, at(4)), received=12),
                RecordedMessage(13, TF, b'torn'),
                message(('map', 'odom', 5, at(5)), ('map', 'base', 6, at(6)), received=14)]
    window = decode(arrivals, Decoder())
    assert window.received.tolist() == [10, 11, 12, 13, 14]
    assert window.others == [1, 3]
    assert {edge: [(int(number), int(stamp), pose[0]) for number, stamp, pose
                   in zip(*samples, strict=True)] for edge, samples in window.edges.items()} == {
        ('map', 'odom'): [(0, 1, 1.0), (4, 5, 5.0)], ('map', 'odo2'): [(2, 3, 3.0)],
        ('map', 'base'): [(0, 2, 2.0), (2, 4, 4.0), (4, 6, 6.0)]}


@pytest.mark.parametrize(('layouts', 'left'), [(7, 0), (8, 0), (9, 1), (12, 4)])
def test_eight_layouts_of_one_size_are_read_together(layouts, left):
    arrivals = [message(('map', f'child{number:02}', 5, ONE)) for number in range(layouts)]
    window = decode(arrivals, Decoder())
    assert window.others == list(range(layouts - left, layouts))
    assert len(window.edges) == layouts - left


def test_message_that_never_fits_ends_the_search():
    """Its only stamp is impossible, so it fits no layout, not even its own."""
    bad = RecordedMessage(0, TF, serialize([('map', 'base', 1, 10**9, ONE)]))
    good = message(('map', 'base', 5, ONE))
    assert decode([bad, bad], Decoder()).others == [0, 1]
    window = decode([bad, good], Decoder())
    assert (window.others, [len(each.stamps) for each in window.edges.values()]) == ([0], [1])


# --- names

def test_names_are_prefixed_by_topic_and_chosen():
    both = prefixed('r1/', ['map'])(TF)
    assert both('map', 'base') == ('map', 'r1/base')
    of_topic = prefixed({'/tf': 'r2/'}, ())
    assert of_topic(TF)('map', 'base') == ('r2/map', 'r2/base')
    assert of_topic(STATIC)('map', 'base') == ('map', 'base')
    asked = []

    def wanted(parent, child):
        asked.append((parent, child))
        return child != 'r1/arm'

    names = renames(prefixed('r1/', ['map']), wanted)(TF)
    assert names('map', 'base') == ('map', 'r1/base')
    assert names('map', 'arm') is None
    assert asked == [('map', 'r1/base'), ('map', 'r1/arm')]
    assert renames(lambda _: lambda *edge: None, wanted)(TF)('map', 'base') is None
    assert len(asked) == 2


def test_decoder_keeps_a_reader_for_each_connection():
    decoder = Decoder()
    assert decoder.reader_of(TF) is decoder.reader_of(TF._replace())
    assert decoder.reader_of(TF) is not decoder.reader_of(STATIC)
    assert decoder.read(message(('/map', 'base', 5, ONE))).edges == (('map', 'base'),)
    old = TF._replace(encoding='ros1')
    data = serialize_ros1([('map', 'base', 1, 2, ONE)])
    assert decoder.read(RecordedMessage(0, old, data)).stamps == [SECOND + 2]
    bad = decoder.read(RecordedMessage(0, TF, b''))
    assert (bad.kind, bad.authority) == (Kind.MALFORMED, TF.authority)
    late = serialize([('map', 'base', 1, 10**9, ONE)])
    assert [len(decoder.read(RecordedMessage(0, each, late)).stamps)
            for each in (TF, STATIC)] == [0, 1]


# --- the order of arrival

BEGIN = 1_700_000_000 * SECOND


@pytest.mark.parametrize(('place', 'bad', 'words'), [
    (0, BEGIN - 2 * 86_400 * SECOND, '2023-11-12T22:13:20 UTC, 2 days before'),
    (0, BEGIN - 2 * 86_400 * SECOND + 30 * SECOND,
     '2023-11-12T22:13:50 UTC, 172770.020 s before'),
    (50, BEGIN + 3601 * SECOND, '2023-11-14T23:13:21 UTC, 3600.020 s after'),
    (99, BEGIN - 3600 * SECOND, '2023-11-14T21:13:20 UTC, 3601.960 s before')])
def test_lone_stamp_is_described_by_its_neighbours(place, bad, words):
    stamps = BEGIN + np.arange(100) * SECOND // 50
    received = stamps + 5
    stamps[place] = bad
    good = np.delete(stamps, place)
    one, many = ArrivalOrder(), ArrivalOrder()
    for number in range(100):
        one.add(('map', 'base'), int(received[number]), int(stamps[number]),
                '/a' if number % 2 else '/b')
    many.add_many(('map', 'base'), received[:60], stamps[:60], '/b')
    many.add_many(('map', 'base'), received[60:], stamps[60:], '/a')
    for order in (one, many):
        assert {edge: each.tolist() for edge, each in order.stamps().items()} == {
            ('map', 'base'): stamps.tolist()}
        ((edge, lone, detail),) = order.lone()
        assert (edge, lone.tolist()) == (('map', 'base'), [bad])
        arrived = f'{received[place] // SECOND}.{received[place] % SECOND:09d}'
        assert detail == (
            f'{words} its neighbours; received at {arrived} s, from one of /a, /b. Lookups '
            'between it and the others are interpolated over that time: leave it out with '
            f'tf_export --from {good[0]} --to {good[-1]}, or start and stop of stamps_at_rate')
