# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Whatever arrives, the listener continues, and reports it."""

from collections import Counter
import itertools
import math
import warnings

from hand_clock import clock_of_logs
import pytest
from rclpy.serialization import serialize_message
from ros_helpers import at, LATEST, PATIENCE, Talker, transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer
from tf_tree_py.core import Kind
from tf_tree_py.core.messages.incidents import REMARKS

NAN, INF = math.nan, math.inf


@pytest.fixture(autouse=True)
def no_warnings():
    """Fail a test if numpy warns about a publisher's values."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        yield
    assert [warning for warning in caught if warning.category is RuntimeWarning] == []


@pytest.fixture(autouse=True)
def log_clock(monkeypatch):
    """Stop the clock of the log, so that no second of it ends."""
    return clock_of_logs(monkeypatch)


@pytest.fixture
def buffer(node, listen):
    return listen(node)


def message(*transforms):
    return TFMessage(transforms=transforms)


def with_numbers(child, **numbers):
    sent = transform('map', child)
    for name, value in numbers.items():
        part = 'rotation' if name.startswith('q') else 'translation'
        setattr(getattr(sent.transform, part), name.removeprefix('q'), value)
    return sent


def incidents(buffer):
    return {kind: count for kind, count in buffer.statistics().incidents.items() if count}


_markers = itertools.count(1)


def send_and_settle(talker, buffer, *sent):
    """Send messages or bytes, then a good transform, and wait for the latter."""
    stamp = next(_markers)
    for each in sent:
        talker.send(each)
    talker.send(message(transform('map', 'marker', stamp, x=float(stamp))))
    found = buffer.lookup_transform('map', 'marker', at(stamp), PATIENCE)
    assert found.transform.translation.x == stamp


def stamped(child, nanosec):
    sent = transform('map', child)
    sent.header.stamp.sec, sent.header.stamp.nanosec = 1_700_000_000, nanosec
    return sent


WRONG = [
    (with_numbers('a', x=NAN), Kind.NOT_FINITE, 'nan'),
    (with_numbers('b', qz=NAN), Kind.NOT_FINITE, 'nan'),
    (with_numbers('c', y=INF), Kind.NOT_FINITE, 'inf'),
    (with_numbers('d', y=INF, z=-INF), Kind.NOT_FINITE, 'inf'),
    (with_numbers('e', qx=-INF), Kind.NOT_FINITE, 'inf'),
    (with_numbers('f', qw=0.0), Kind.ZERO_ROTATION, 'left unset'),
    (stamped('k', 10**9), Kind.IMPOSSIBLE_STAMP, 'nanosec is 1000000000'),
    (stamped('l', 2**32 - 1), Kind.IMPOSSIBLE_STAMP, 'nanosec is 4294967295'),
    (transform('', 'g'), Kind.EMPTY_FRAME, 'header.frame_id'),
    (transform('/', 'h'), Kind.EMPTY_FRAME, 'header.frame_id'),
    (transform('map', ''), Kind.EMPTY_FRAME, 'child_frame_id'),
    (transform('', ''), Kind.EMPTY_FRAME, 'is not set'),
    (transform('i', 'i'), Kind.SELF_EDGE, 'the same'),
    (transform('/j', 'j'), Kind.SELF_EDGE, 'the same'),
    (transform('good', 'map'), Kind.LOOP, 'would close a loop'),
]


def test_transform_that_cannot_be_is_counted_and_skipped(buffer, talker, log):
    sent = message(transform('map', 'good', x=1.0), *[wrong for wrong, *_ in WRONG],
                   transform('map', 'better', x=2.0), with_numbers('long', qw=2.0),
                   with_numbers('tiny', qw=-1e-9), with_numbers('huge', qw=1e200))
    send_and_settle(talker, buffer, sent, sent)
    assert incidents(buffer) == Counter([kind for _, kind, _ in WRONG] * 2)
    assert buffer.statistics().refused == 2 * len(WRONG)
    assert set(buffer.frames()) == {'map', 'marker', 'good', 'better', 'long', 'tiny', 'huge'}
    assert buffer.lookup_transform('good', 'better', LATEST).transform.translation.x == 1.0
    for child in ('long', 'tiny', 'huge'):
        assert abs(buffer.lookup('map', child).qw) == pytest.approx(1.0), 'it is normalised'
    kinds = {kind for _, kind, _ in WRONG}
    until(lambda: log().count('Refused transform') == len(kinds))
    assert len(log().splitlines()) == len(kinds), 'a line a second for each kind'


def test_transform_that_cannot_be_is_logged_with_its_reason(buffer, talker, log, log_clock):
    send_and_settle(talker, buffer, message(transform('map', 'good')))
    for count, (wrong, kind, word) in enumerate(WRONG, 1):
        log_clock.now += 1.0
        send_and_settle(talker, buffer, message(wrong))
        until(lambda count=count: log().count('Refused transform') == count)
        line = log().splitlines()[-1]
        for part in ('Refused transform', '[asking]', '/talking', kind.value, word):
            assert part in line


def test_count_of_what_was_not_logged_follows_without_another_message(
        buffer, talker, log, log_clock):
    send_and_settle(talker, buffer, *[message(with_numbers(f'child_{number}', x=NAN))
                                      for number in range(50)])
    until(lambda: 'NaN or infinity' in log())
    assert len(log().splitlines()) == 1
    log_clock.now += 1.0
    until(lambda: len(log().splitlines()) == 2)
    assert ("49 more like this from '/talking': NaN or infinity, in 1.0 s, such as 'map' -> "
            "'child_1'; 'map' -> 'child_2'; ") in log()


def test_bytes_that_are_no_message_are_counted_and_logged(buffer, talker, log):
    """For each reason; test/core/test_wire.py has the words for it."""
    send_and_settle(talker, buffer, message())
    assert incidents(buffer) == {}, 'an empty message is none'
    assert buffer.statistics().accepted == 1
    whole = serialize_message(message(transform('map', 'odom')))
    data = [b'', b'\0', b'\0\1\0\0', b'\0\1\0\0\xff\xff\xff\xff', b'rubbish',
            *[whole.replace(before, after) for before, after in [
                (b'odom', b'o\xff\xfem'), (b'map\0', b'map!'),
                (b'\4\0\0\0map', b'\xff\xff\xff\x7fmap'), (b'\0\1\0\0\1', b'\0\1\0\0\2')]],
            *[whole[:size] for size in range(5, len(whole))]]
    for count, damaged in enumerate(data, 1):
        send_and_settle(talker, buffer, damaged)
        assert incidents(buffer) == {Kind.MALFORMED: count}, damaged
    until(lambda: 'malformed message' in log())
    (line,) = [line for line in log().splitlines() if 'malformed' in line]
    assert 'not CDR' in line
    assert '/talking' in line


ODOM = ('map', 'odom')


@pytest.mark.parametrize(('sent', 'counts', 'words'), [
    ([(*ODOM, 1.0), ('odom', 'base'), ('base', 'map'), ('camera', 'base')], {Kind.LOOP: 2},
     ['would close a loop', "'base' -> 'map'", '/talking', "'odom' -> 'base'", "'map' -> 'odom'",
      "'camera' -> 'base'"]),
    ([(*ODOM, 100.0), (*ODOM, 89.0), (*ODOM, 90.0)], {Kind.OLD_DATA: 1},
     ['older than the buffer keeps', '89.000000000', '11.000 s', '100.000000000',
      'A bag that loops', '/talking']),
    ([(*ODOM, 2_000_000_000.0), *[(*ODOM, float(second)) for second in range(100, 105)]],
     {Kind.AHEAD_OF_CLOCK: 1, Kind.OLD_DATA: 5}, ['The newest stamp of this edge is']),
    ([('base', 'camera', 5.0)], {Kind.KIND_CHANGE: 1}, ['it was static from']),
], ids=['loop', 'past', 'far future', 'static that moves'])
def test_log_names_the_likely_cause(buffer, talker, log, log_clock, sent, counts, words):
    talker.fix(transform('base', 'camera'), into=buffer)
    send_and_settle(talker, buffer, *[message(transform(*each)) for each in sent])
    assert incidents(buffer) == counts
    parent, child, stamp = sent[0]
    assert buffer.lookup_transform(parent, child, LATEST).header.stamp.sec == stamp
    assert buffer.statistics().refused == sum(
        count for kind, count in counts.items() if kind not in REMARKS)
    log_clock.now += 1.0  # the second edge of a kind is in the count
    until(lambda: all(word in log() for word in words))


def test_any_stamp_that_a_message_can_carry_is_taken(buffer, talker):
    stamps = [-2**31, -1, 0, 1, 2**31 - 1]
    sent = [transform('map', f'at {stamp}') for stamp in stamps]
    for each, stamp in zip(sent, stamps, strict=True):
        each.header.stamp.sec, each.header.stamp.nanosec = stamp, 999_999_999
    send_and_settle(talker, buffer, message(*sent))
    assert buffer.statistics().refused == 0
    assert all(buffer.can_transform('map', each.child_frame_id, LATEST) for each in sent)


def test_message_without_any_possible_stamp_is_refused_and_a_static_one_is_taken(
        buffer, talker, log):
    talker.fix(stamped('camera', 2**32 - 1), into=buffer)
    send_and_settle(talker, buffer, message(stamped('imu', 10**9)),
                    message(*[stamped(f'imu_{number}' + 100 * 'x', 10**9)
                              for number in range(1000)]))
    until(lambda: incidents(buffer) == {Kind.IMPOSSIBLE_STAMP: 1001})
    assert set(buffer.frames()) == {'map', 'camera', 'marker'}
    until(lambda: "'map' -> 'imu' from '/talking' (impossible stamp)" in log())


def test_message_without_any_possible_stamp_is_refused_where_two_nodes_publish(
        buffer, talker, make_node, log):
    """The numbers of messages are compared only there."""
    beside = Talker(make_node('beside'))

    def both_are_known():
        talker.send(message(transform('map', 'table')))
        beside.send(message(transform('map', 'wheel')))
        return {edge.authority for edge in buffer.edges()} == {'one of /beside, /talking'}

    until(both_are_known)
    send_and_settle(talker, buffer, message(stamped('imu', 4_293_967_296)))
    assert incidents(buffer) == {Kind.IMPOSSIBLE_STAMP: 1}
    until(lambda: "'map' -> 'imu' from 'one of /beside, /talking' (impossible stamp)" in log())
    assert len(log().splitlines()) == 1, 'no callback failed'


@pytest.mark.parametrize(('topic', 'known', 'words'), [
    ('/slam/tf', {'/odometry', '/slam'},
     ["'/odometry' says that its parent is 'odom'", "'map' -> 'base' from '/slam'"]),
    ('/tf', {'one of /odometry, /slam'}, ["-> 'base' from 'one of /odometry, /slam'"]),
])
def test_two_publishers_that_fight_over_a_frame_are_logged_once(
        node, make_node, buffer, listen, log, topic, known, words):
    """On one topic, the sender of a message is unknown."""
    listen(node, buffer, tf_topic='/slam/tf')
    odometry, slam = Talker(make_node('odometry')), Talker(make_node('slam'))

    def both_are_known():
        odometry.send(message(transform('odom', 'wheel')))
        slam.send(message(transform('map', 'table')), topic)
        return {edge.authority for edge in buffer.edges()} == known

    until(both_are_known)
    for i in range(4):
        odometry.send(message(transform('odom', 'base', 1.0 + i)))
        buffer.lookup_transform('odom', 'base', at(1.0 + i), PATIENCE)
        slam.send(message(transform('map', 'base', 1.5 + i)), topic)
        buffer.lookup_transform('map', 'base', at(1.5 + i), PATIENCE)
    assert incidents(buffer) == {Kind.SECOND_PARENT: 1}
    assert buffer.statistics().refused == 0
    until(lambda: 'two publishers' in log())
    for each in words:
        assert each in log()


def test_flood_of_rubbish_is_survived_and_logged_in_a_few_lines(node, listen, talker, log):
    buffer = listen(node, Buffer(max_frames=5))
    hostile = 'a\n[ERROR] forged %s %n \x1b[31m'
    rubbish = [b'\0\1\0\0', message(transform('d', 'd')), message(with_numbers(hostile, x=NAN)),
               *[message(with_numbers(f'child_{i}', y=NAN)) for i in range(50)]]
    send_and_settle(talker, buffer)
    for turn in range(20):
        new_names = message(*[transform('map', f'new_{turn}_{i}') for i in range(100)])
        send_and_settle(talker, buffer, *rubbish, new_names)
    counts = buffer.statistics()
    assert counts.frames == 5
    assert counts.accepted == 21 + 3, 'the markers, and as many names as there is room for'
    assert counts.incidents[Kind.TOO_MANY_FRAMES] == 20 * 100 - 3
    assert counts.refused == 20 * (len(rubbish) + 100) - 3
    until(lambda: 'malformed' in log() and 'max_frames' in log())
    assert len(log().splitlines()) <= 4, 'one of each kind'
    (line,) = [line for line in log().splitlines() if 'forged' in line]
    assert 'Refused transform' in line
    assert '\\n[ERROR]' in line
    assert '\x1b[31m' not in line


# --- by hand


def test_set_transform_returns_whether_it_was_taken(log):
    buffer = Buffer()
    assert buffer.set_transform(transform('map', 'odom', 100.0), 'me') is True
    assert buffer.set_transform(transform('map', 'odom', 5.0)) is False
    assert buffer.set_transform_static(with_numbers('cam', x=NAN), 'me') is False
    assert buffer.set_transform_static(transform('odom', 'cam'), 'me') is True
    assert buffer.set_transform(transform('odom', 'cam')) is True, 'with a remark'
    until(lambda: 'change of kind' in log())
    assert "from 'me'" in log()
    assert [edge.authority for edge in buffer.edges()] == ['me', 'default_authority']


def test_transform_with_an_impossible_stamp_is_taken_by_hand_only_as_a_static_one(log):
    buffer = Buffer()
    assert buffer.set_transform(stamped('imu', 10**9), 'me') is False
    assert incidents(buffer) == {Kind.IMPOSSIBLE_STAMP: 1}
    until(lambda: "'map' -> 'imu' from 'me' (impossible stamp)" in log())
    assert buffer.set_transform_static(stamped('imu', 10**9), 'me') is True
    assert buffer.set_transform(stamped('wheel', 10**9 - 1), 'me') is True
