# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Whatever arrives, the listener continues, and reports it."""

from collections import Counter
import itertools
import math
import warnings

import pytest
from rclpy.serialization import serialize_message
from ros_helpers import at, LATEST, PATIENCE, Talker, transform, until
from tf2_msgs.msg import TFMessage
from tf_tree_py import Buffer, FutureExtrapolationException, Incident
from tf_tree_py.core import Kind

NAN, INF = math.nan, math.inf


@pytest.fixture(autouse=True)
def no_warnings():
    """Fail a test if numpy warns about a publisher's values."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter('always')
        yield
    assert [str(warning.message) for warning in caught] == []


@pytest.fixture
def buffer(node, listen):
    return listen(node)


def message(*transforms):
    return TFMessage(transforms=transforms)


def damaged(before, after):
    return serialize_message(message(transform('map', 'odom'))).replace(before, after)


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


@pytest.mark.parametrize(('sent', 'kind', 'words'), [
    (with_numbers('a', x=NAN), Kind.NOT_FINITE, ['nan']),
    (with_numbers('a', qz=NAN), Kind.NOT_FINITE, ['nan']),
    (with_numbers('a', y=INF), Kind.NOT_FINITE, ['inf']),
    (with_numbers('a', y=INF, z=-INF), Kind.NOT_FINITE, ['inf']),
    (with_numbers('a', qx=-INF), Kind.NOT_FINITE, ['inf']),
    (with_numbers('a', qw=0.0), Kind.ZERO_ROTATION, ['left unset']),
    (transform('', 'a'), Kind.EMPTY_FRAME, ['header.frame_id']),
    (transform('/', 'a'), Kind.EMPTY_FRAME, ['header.frame_id']),
    (transform('map', ''), Kind.EMPTY_FRAME, ['child_frame_id']),
    (transform('', ''), Kind.EMPTY_FRAME, ['is not set']),
    (transform('a', 'a'), Kind.SELF_EDGE, ['the same']),
    (transform('/a', 'a'), Kind.SELF_EDGE, ['the same']),
])
def test_transform_that_cannot_be_is_counted_logged_and_skipped(
        buffer, talker, log, sent, kind, words):
    send_and_settle(talker, buffer, message(sent, transform('map', 'good')), message(sent))
    assert incidents(buffer) == {kind: 2}
    assert buffer.statistics().refused == 2
    assert set(buffer.frames()) == {'map', 'good', 'marker'}
    until(lambda: kind.value in log())
    (line,) = [line for line in log().splitlines() if kind.value in line]
    assert 'Refused transform' in line
    for word in ['[asking]', '/talking', *words]:
        assert word in line


@pytest.mark.parametrize(('data', 'words'), [
    (b'', 'not CDR'),
    (b'\0', 'not CDR'),
    (b'\0\1\0\0', 'truncated'),
    (b'\0\1\0\0\xff\xff\xff\xff', 'cannot hold 4294967295 transforms'),
    (b'rubbish', 'not CDR'),
    (damaged(b'odom', b'o\xff\xfem'), 'not UTF-8'),
    (damaged(b'map\0', b'map!'), 'does not end with NUL'),
    (damaged(b'\4\0\0\0map', b'\xff\xff\xff\x7fmap'), 'truncated'),
    (damaged(b'\0\1\0\0\1', b'\0\1\0\0\2'), 'hold 2 transforms|truncated'),
], ids=['empty', 'one_byte', 'no_count', 'too_many', 'rubbish', 'no_utf8', 'no_nul',
        'long_name', 'one_too_many'])
def test_bytes_that_are_no_message_are_counted_and_logged(buffer, talker, log, data, words):
    send_and_settle(talker, buffer, data, data)
    assert incidents(buffer) == {Kind.MALFORMED: 2}
    until(lambda: 'malformed message' in log())
    (line,) = [line for line in log().splitlines() if 'malformed' in line]
    assert any(word in line for word in words.split('|'))
    assert '/talking' in line


def test_truncated_messages_do_not_stop_the_listener(buffer, talker):
    whole = serialize_message(message(transform('map', 'odom')))
    for count, size in enumerate(range(5, 96, 7), 1):
        send_and_settle(talker, buffer, whole[:size])
        assert incidents(buffer) == {Kind.MALFORMED: count}, size


def test_empty_message_is_no_incident(buffer, talker):
    send_and_settle(talker, buffer, message())
    assert incidents(buffer) == {}
    assert buffer.statistics().accepted == 1


def test_loop_is_refused_and_all_who_are_in_it_are_named(buffer, make_node, talker, log):
    send_and_settle(talker, buffer, message(transform('map', 'odom'), transform('odom', 'base')))
    send_and_settle(talker, buffer, message(transform('base', 'map')))
    assert incidents(buffer) == {Kind.LOOP: 1}
    assert buffer.can_transform('map', 'base', LATEST)
    until(lambda: 'would close a loop' in log())
    for name in ("'base' -> 'map'", '/talking', "'odom' -> 'base'", "'map' -> 'odom'"):
        assert name in log()


def test_loop_through_a_static_edge_is_refused(buffer, talker):
    talker.fix(transform('base', 'camera'))
    buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    send_and_settle(talker, buffer, message(transform('camera', 'base')))
    assert incidents(buffer) == {Kind.LOOP: 1}


def test_old_data_is_counted_and_its_likely_cause_told(buffer, talker, log):
    send_and_settle(talker, buffer, message(transform('map', 'odom', 100.0)),
                    message(transform('map', 'odom', 89.0)),
                    message(transform('map', 'odom', 90.0)))
    assert incidents(buffer) == {Kind.OLD_DATA: 1}
    until(lambda: 'older than the buffer keeps' in log())
    for words in ('89.000000000', '11.000 s', '100.000000000', 'A bag that loops', '/talking'):
        assert words in log()


def test_far_future_stamp_makes_all_after_it_old_and_is_told(buffer, talker, log):
    send_and_settle(talker, buffer, message(transform('map', 'odom', 2_000_000_000.0)),
                    *[message(transform('map', 'odom', 100.0 + i)) for i in range(5)])
    assert incidents(buffer) == {Kind.AHEAD_OF_CLOCK: 1, Kind.OLD_DATA: 5}
    assert buffer.lookup_transform('map', 'odom', LATEST).header.stamp.sec == 2_000_000_000
    until(lambda: 'The newest stamp of this edge is' in log())


@pytest.mark.parametrize('stamp', [-2**31, -1, 0, 1, 2**31 - 1])
def test_any_stamp_that_a_message_can_carry_is_taken(buffer, talker, stamp):
    sent = transform('map', 'odom')
    sent.header.stamp.sec = stamp
    sent.header.stamp.nanosec = 4_294_967_295
    send_and_settle(talker, buffer, message(sent))
    assert buffer.statistics().refused == 0
    assert buffer.can_transform('map', 'odom', LATEST)


def test_static_that_moves_and_the_reverse_are_told(buffer, talker, log):
    talker.fix(transform('base', 'camera'))
    buffer.lookup_transform('base', 'camera', LATEST, PATIENCE)
    send_and_settle(talker, buffer, message(transform('base', 'camera', 5.0)))
    assert incidents(buffer) == {Kind.KIND_CHANGE: 1}
    assert buffer.statistics().refused == 0
    until(lambda: 'it was static from' in log())


def test_two_publishers_that_fight_over_a_frame_are_told_once(node, make_node, listen, log):
    """Each on its own topic: on one topic, the sender of a message is unknown."""
    buffer = listen(node)
    listen(node, buffer, tf_topic='/slam/tf')
    odometry, slam = Talker(make_node('odometry')), Talker(make_node('slam'))
    for i in range(4):
        odometry.send(message(transform('odom', 'base', 1.0 + i)))
        buffer.lookup_transform('odom', 'base', at(1.0 + i), PATIENCE)
        slam.send(message(transform('map', 'base', 1.5 + i)), '/slam/tf')
        buffer.lookup_transform('map', 'base', at(1.5 + i), PATIENCE)
    assert incidents(buffer) == {Kind.SECOND_PARENT: 1}
    assert buffer.statistics().refused == 0
    until(lambda: 'two publishers' in log())
    for words in ("'/odometry' says that its parent is 'odom'", "'map' -> 'base' from '/slam'"):
        assert words in log()


def test_fight_on_one_topic_is_told_once_with_both_names(node, make_node, listen, log):
    buffer = listen(node)
    odometry, slam = Talker(make_node('odometry')), Talker(make_node('slam'))
    odometry.send(message(transform('odom', 'wheel', 1.0)))
    slam.send(message(transform('map', 'table', 1.0)))
    until(lambda: _both_are_known(buffer, odometry))
    for i in range(3):
        odometry.send(message(transform('odom', 'base', 1.0 + i)))
        buffer.lookup_transform('odom', 'base', at(1.0 + i), PATIENCE)
        slam.send(message(transform('map', 'base', 1.5 + i)))
        buffer.lookup_transform('map', 'base', at(1.5 + i), PATIENCE)
    assert incidents(buffer) == {Kind.SECOND_PARENT: 1}
    until(lambda: 'two publishers' in log())
    assert 'one of /odometry, /slam' in log()


def _both_are_known(buffer, talker):
    """Send until the listener has queried the graph again; return whether it names both."""
    talker.send(message(transform('odom', 'wheel', 2.0)))
    return any('one of' in edge.authority for edge in buffer.edges())


def test_everything_wrong_in_one_message_costs_nothing_else(buffer, talker):
    send_and_settle(talker, buffer, message(
        transform('map', 'a', x=1.0), with_numbers('b', x=NAN), transform('', 'c'),
        transform('d', 'd'), with_numbers('e', qw=0.0), transform('a', 'map'),
        transform('map', 'f', x=2.0)))
    assert incidents(buffer) == {
        Kind.NOT_FINITE: 1, Kind.EMPTY_FRAME: 1, Kind.SELF_EDGE: 1, Kind.ZERO_ROTATION: 1,
        Kind.LOOP: 1}
    assert buffer.lookup_transform('a', 'f', LATEST).transform.translation.x == 1.0
    assert buffer.statistics().accepted == 3


def test_quaternion_of_another_length_is_normalised(buffer, talker):
    send_and_settle(talker, buffer, message(with_numbers('a', qw=2.0), with_numbers('b', qw=-1e-9),
                                            with_numbers('c', qw=1e200)))
    for child in 'abc':
        assert abs(buffer.lookup('map', child).qw) == pytest.approx(1.0)


def test_ten_thousand_new_names_a_second_are_survived(node, listen, talker, log):
    buffer = listen(node, Buffer(max_frames=500))
    send_and_settle(talker, buffer)
    # In parts that fit the topic's queue, so that every one of them is counted.
    for i in range(4):
        send_and_settle(talker, buffer, *[
            message(*[transform('map', f'rubbish_{i}_{j}_{k}') for k in range(100)])
            for j in range(25)])
    counts = buffer.statistics()
    assert counts.frames == 500
    assert counts.incidents[Kind.TOO_MANY_FRAMES] == 10_000 - 498
    assert counts.accepted == 498 + 5
    until(lambda: 'max_frames' in log())
    lines = [line for line in log().splitlines() if 'too many frames' in line]
    assert 1 <= len(lines) <= 10


def test_flood_of_rubbish_is_logged_in_a_few_lines(buffer, talker, log):
    rubbish = [b'\0\1\0\0', message(transform('d', 'd')), message(with_numbers('x', x=NAN)),
               *[message(with_numbers(f'child_{i}', y=NAN)) for i in range(50)]]
    for _ in range(20):
        send_and_settle(talker, buffer, *rubbish)
    assert buffer.statistics().refused == 20 * len(rubbish)
    until(lambda: 'malformed' in log())
    lines = Counter(kind for line in log().splitlines() for kind in Kind if kind.value in line)
    assert lines[Kind.MALFORMED] == lines[Kind.SELF_EDGE] == 1
    assert 2 <= lines[Kind.NOT_FINITE] <= 5


def test_hostile_name_stays_on_its_line_of_the_log(buffer, talker, log):
    hostile = 'a\n[ERROR] forged %s %n \x1b[31m'
    send_and_settle(talker, buffer, message(with_numbers(hostile, x=NAN)))
    until(lambda: 'NaN or infinity' in log())
    (line,) = [line for line in log().splitlines() if 'forged' in line]
    assert 'Refused transform' in line
    assert '\\n[ERROR]' in line
    assert '\x1b[31m' not in line


def test_rubbish_does_not_disturb_those_who_wait(buffer, talker, pool):
    asked = pool.submit(buffer.lookup_transform, 'map', 'odom', at(2.0), PATIENCE)
    until(lambda: len(buffer.waiting))
    send_and_settle(talker, buffer, message(with_numbers('odom', x=NAN)), b'\0\1',
                    message(transform('map', 'odom', 1.0)))
    assert not asked.done()
    talker.send(message(transform('map', 'odom', 2.0)))
    asked.result()


# --- by hand


def test_set_transform_tells_whether_it_was_taken(log):
    buffer = Buffer()
    assert buffer.set_transform(transform('map', 'odom', 100.0), 'me') is True
    assert buffer.set_transform(transform('map', 'odom', 5.0), 'me') is False
    assert buffer.set_transform(transform('odom', 'odom'), 'me') is False
    assert buffer.set_transform_static(with_numbers('cam', x=NAN), 'me') is False
    assert buffer.set_transform_static(transform('odom', 'cam'), 'me') is True
    assert buffer.set_transform(transform('odom', 'cam'), 'you') is True, 'with a remark'
    until(lambda: 'change of kind' in log())
    assert "from 'me'" in log()
    with pytest.raises(FutureExtrapolationException):
        buffer.lookup_transform('map', 'odom', at(101.0))


def test_transform_without_an_authority_has_tf2s_default():
    buffer = Buffer()
    buffer.set_transform(transform('map', 'odom'))
    assert buffer.edges()[0].authority == 'default_authority'


def test_incident_can_be_recorded_by_others():
    buffer = Buffer()
    buffer.feeds.refuse(Incident(Kind.MALFORMED, 'a', 'b', 0, 'me', 'because'))
    assert buffer.statistics().incidents[Kind.MALFORMED] == 1
