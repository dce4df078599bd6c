# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Stamps before 1970 and after 2038 give a result, or an error that explains them."""

from builtin_interfaces.msg import Time as TimeMessage
from inputs import for_each
import pytest
from rclpy.duration import Duration
from ros_helpers import FAR_STAMPS, FIRST, LAST, Moment, PATIENCE
from tf_tree_py import Buffer, InvalidArgumentException, Pose, TransformException
from tf_tree_py.core.ingest.wire import read, write

SECOND = 10**9
INTERVAL = Duration(seconds=0.1)


def buffer_around(stamp):
    buffer = Buffer(Duration(seconds=10**9))
    for moment in (stamp - SECOND // 2, stamp, stamp + SECOND // 2):
        assert not any(told.refused for told in buffer.insert('map', 'base', moment, Pose()))
    return buffer


QUESTIONS = {
    'lookup_transform': lambda buffer, time: buffer.lookup_transform('map', 'base', time),
    'with a timeout': lambda buffer, time: buffer.lookup_transform(
        'map', 'base', time, Duration(nanoseconds=1)),
    'full': lambda buffer, time: buffer.lookup_transform_full('map', time, 'base', time, 'map'),
    'core': lambda buffer, time: buffer.lookup_transform_core('map', 'base', time),
    'can': lambda buffer, time: buffer.can_transform('map', 'base', time),
    'can core': lambda buffer, time: buffer.can_transform_core('map', 'base', time),
    'future': lambda buffer, time: buffer.wait_for_transform_async('map', 'base', time).result(),
    'common time': lambda buffer, time: buffer.get_latest_common_time('map', 'base'),
    'twist': lambda buffer, time: buffer.lookup_twist('map', 'base', time, INTERVAL),
    'yaml': lambda buffer, time: buffer.all_frames_as_yaml(),
    'wire': lambda buffer, time: read(write([('map', 'base', time.nanoseconds, Pose())])),
}


@for_each(question=QUESTIONS, stamp=FAR_STAMPS)
def test_every_question_has_an_answer_or_an_error_of_ours(question, stamp):
    buffer = buffer_around(stamp)
    try:
        answer = QUESTIONS[question](buffer, Moment(stamp))
    except TransformException as error:
        assert 'no message can hold it' in str(error) or 'cannot be negative' in str(error) or (
            'extrapolation' in str(error))
    else:
        assert answer is not None


def test_future_that_waited_ends_with_an_error_of_ours():
    buffer = Buffer()
    future = buffer.wait_for_transform_async('map', 'base', Moment(LAST + 1))
    buffer.insert('map', 'base', LAST + 1, Pose())
    with pytest.raises(InvalidArgumentException, match='no message can hold it'):
        future.result()
    assert future.done()
    assert buffer.statistics().accepted == 1


@for_each(stamp=[FIRST, -1, 0, 1, LAST])
def test_stamp_of_a_message_is_found_and_answered_with(stamp):
    buffer = buffer_around(stamp)
    sec = min(stamp // SECOND, 2**31 - 1)
    time = TimeMessage(sec=sec, nanosec=stamp - sec * SECOND)
    if stamp:
        assert buffer.lookup_transform('map', 'base', time).header.stamp == time
    assert read(write([('map', 'base', stamp, Pose())])).stamps == [stamp]


def test_latest_common_time_before_1970_says_whom_to_ask_instead():
    stamp = -5 * SECOND
    buffer = buffer_around(stamp)
    with pytest.raises(InvalidArgumentException, match=r"'map' and 'base' is -4\.5.*negative\.\n"
                                                       r'latest_common_time\(\) returns'):
        buffer.get_latest_common_time('map', 'base')
    assert buffer.latest_common_time('map', 'base') == stamp + SECOND // 2


def test_longest_timeout_is_no_error(pool):
    """Programs use it for an unlimited wait."""
    buffer = Buffer()
    forever = Duration(nanoseconds=2**63 - 1)
    asked = pool.submit(buffer.lookup_transform, 'map', 'base', Moment(SECOND), forever)
    assert buffer.waiting.sleep_until_somebody(PATIENCE.nanoseconds / SECOND)
    buffer.insert('map', 'base', SECOND, Pose())
    assert asked.result(PATIENCE.nanoseconds / SECOND).header.stamp.sec == 1
    waited = buffer.wait_for_transform_async('map', 'base', Moment(2 * SECOND), forever)
    buffer.insert('map', 'base', 2 * SECOND, Pose())
    assert waited.result().header.stamp.sec == 2
