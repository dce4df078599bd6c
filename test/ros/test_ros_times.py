# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""ROS times wherever a buffer takes stamps; far ones give a result, or an error that explains."""

import pickle
import re

from builtin_interfaces.msg import Time as TimeMessage
from inputs import for_each
import numpy as np
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import at, FAR_STAMPS, FIRST, LAST, lasting, Moment, PATIENCE_S, transform
from tf_tree_py import Buffer, deskew, InvalidArgumentException, Pose, TransformException
from tf_tree_py.core.messages.wire import read, WireReader, write

SECOND = 10**9


@pytest.fixture
def buffer():
    buffer = Buffer()
    for second in range(1, 5):
        buffer.set_transform(transform('map', 'base', second, x=float(second)), 'me')
    return buffer


def test_core_queries_take_ros_times(buffer):
    for still in (buffer, buffer.snapshot(), pickle.loads(pickle.dumps(buffer.snapshot()))):
        for time in (at(2.0), at(2.0).to_msg(), Time(seconds=2), 2 * 10**9,
                     np.datetime64(2, 's')):
            assert still.lookup('map', 'base', time) == Pose(2.0)
            assert still.lookup_full('map', time, 'base', time, 'map') == Pose(2.0)
            assert still.lookup_tree('map', time)['base'] == Pose(2.0)
            assert still.frames_between('map', 'base', time) == ['base', 'map']
            assert len(still.edges_between('map', 'base', time)) == 1
            assert still.lookup_many('map', 'base', [time, 10**9])[:, 0].tolist() == [2.0, 1.0]
        assert still.lookup('map', 'base', Time()) == Pose(4.0)
        header = transform('map', 'base', 3.0).header
        assert still.lookup_many('map', 'base', [header.stamp])[0, 0] == 3.0


def test_insertions_points_and_velocities_take_ros_times(buffer):
    assert buffer.insert('map', 'base', at(5.0), Pose(5.0)) == []
    assert buffer.insert_track('map', 'base', [at(6.0).to_msg(), at(7.0)], [Pose(6.0)] * 2) == []
    assert buffer.lookup('map', 'base', at(7.0)) == Pose(6.0)
    times = [at(1.0), at(2.0)]
    assert deskew(buffer, np.zeros((2, 3)), times, 'map', 'base', times[0], 'map')[1, 0] == 2.0
    assert buffer.lookup_twist_many('base', 'map', times, lasting(1.0))[:, 0] == pytest.approx(1)


@pytest.mark.parametrize('time', [1.0, 'now', None, lasting(1.0)])
def test_what_is_no_stamp_is_refused(buffer, time):
    with pytest.raises(InvalidArgumentException, match='stamps are integer nanoseconds'):
        buffer.lookup('map', 'base', time)
    with pytest.raises(InvalidArgumentException, match='stamps? .*integer nanoseconds|not a row'):
        buffer.lookup_many('map', 'base', [time])


def test_buffer_and_its_snapshot_say_what_they_hold(buffer):
    text = '2 frames, 1 edge (0 static), 1.000000000 to 4.000000000 s'
    assert repr(buffer) == f'<Buffer: {text}>'
    assert repr(buffer.snapshot()) == f'<RosSnapshot: {text}>'
    with pytest.raises(TypeError, match='a Buffer cannot be pickled or copied'):
        pickle.dumps(buffer)


# --- before 1970 and after 2038


def buffer_around(stamp):
    buffer = Buffer(Duration(seconds=10**9))
    for moment in (stamp - SECOND // 2, stamp, stamp + SECOND // 2):
        assert not any(told.refused for told in buffer.insert('map', 'base', moment, Pose()))
    return buffer


FRAMES = 'map', 'base'
QUESTIONS = [
    lambda buffer, time: buffer.lookup_transform(*FRAMES, time),
    lambda buffer, time: buffer.lookup_transform(*FRAMES, time, Duration(nanoseconds=1)),
    lambda buffer, time: buffer.lookup_transform_full('map', time, 'base', time, 'map'),
    lambda buffer, time: buffer.lookup_transform_core(*FRAMES, time),
    lambda buffer, time: buffer.can_transform(*FRAMES, time),
    lambda buffer, time: buffer.can_transform_core(*FRAMES, time),
    lambda buffer, time: buffer.wait_for_transform_async(*FRAMES, time).result(),
    lambda buffer, time: buffer.get_latest_common_time(*FRAMES),
    lambda buffer, time: buffer.lookup_twist(*FRAMES, time, lasting(0.1)),
    lambda buffer, time: buffer.all_frames_as_yaml(),
    lambda buffer, time: read(write([(*FRAMES, time.nanoseconds, Pose())])),
]


@for_each(question=QUESTIONS, stamp=FAR_STAMPS)
def test_every_question_has_an_answer_or_an_error_of_ours(question, stamp):
    try:
        answer = question(buffer_around(stamp), Moment(stamp))
    except TransformException as error:
        assert re.search('no message can hold it|cannot be negative|extrapolation', str(error))
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
    static = WireReader(static=True)  # the nanosec of the last stamp is more than a second
    assert static.read(write([('map', 'base', stamp, Pose())])).stamps == [stamp]


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
    assert buffer.waiting.sleep_until_somebody(PATIENCE_S)
    buffer.insert('map', 'base', SECOND, Pose())
    assert asked.result(PATIENCE_S).header.stamp.sec == 1
    waited = buffer.wait_for_transform_async('map', 'base', Moment(2 * SECOND), forever)
    buffer.insert('map', 'base', 2 * SECOND, Pose())
    assert waited.result().header.stamp.sec == 2
