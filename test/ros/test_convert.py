# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Conversion between messages and numbers."""

from datetime import timedelta
import importlib
import math
from types import SimpleNamespace

from builtin_interfaces.msg import Duration as DurationMessage, Time as TimeMessage
from geometry_msgs.msg import TransformStamped
from inputs import for_each
import numpy as np
import pytest
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time
from ros_helpers import FIRST, LAST, transform
from tf_tree_py import Buffer, InvalidArgumentException, Pose
from tf_tree_py.core import Sample
from tf_tree_py.core.geometry import so3

# Not imported from the package, where tf2's function of the same name hides it.
convert = importlib.import_module('tf_tree_py.ros.messages.convert')

POSE = (1.0, -2.0, 3.5, 0.5, -0.5, 0.5, -0.5)
SECOND = 1_000_000_000


@for_each(time_and_nanoseconds=[
    (Time(), 0),
    (Time(seconds=3, nanoseconds=4), 3 * SECOND + 4),
    (Time(nanoseconds=2**62, clock_type=ClockType.ROS_TIME), 2**62),
    (Time(seconds=5).to_msg(), 5 * SECOND),
    (TimeMessage(sec=-1, nanosec=999_999_999), -1),
    (TransformStamped().header.stamp, 0),
    (Duration(seconds=-2), -2 * SECOND),
    (Duration(nanoseconds=7), 7),
    (DurationMessage(sec=1, nanosec=1), SECOND + 1),
    (SimpleNamespace(nanoseconds=12), 12),
    (SimpleNamespace(sec=2, nanosec=3), 2 * SECOND + 3),
])
def test_every_kind_of_time_becomes_nanoseconds(time_and_nanoseconds):
    time, nanoseconds = time_and_nanoseconds
    assert convert.as_nanoseconds(time) == nanoseconds
    assert type(convert.as_nanoseconds(time)) is int


@for_each(wrong_and_hint=[
    *((wrong, r'is not a {what}: pass an? ')
      for wrong in (None, 1, 1.5, '1', SimpleNamespace(sec=1))),
    (0.5, r'0.5 is not a {what}: .*; 0.5 s is {cls}\(seconds=0.5\)$'),
    (2, r'; 2 s is {cls}\(seconds=2\)'),
    (timedelta(seconds=90), r'; 90.0 s is {cls}\(seconds=90.0\)'),
    ('now', r"'now' is not a {what}: [^;]*$"),
    (True, r'True is not a {what}: [^;]*$'),
])
def test_what_is_no_time_is_refused_with_what_to_write(wrong_and_hint):
    wrong, hint = wrong_and_hint
    for cls in (Duration, Time):
        name = cls.__name__
        with pytest.raises(TypeError, match=hint.format(what=name.lower(), cls=name)):
            convert.as_nanoseconds(wrong, cls)


def test_timedelta_of_pandas_is_no_time():
    pandas = pytest.importorskip('pandas')
    # Its attribute .nanoseconds is the remainder below a microsecond: 0.
    with pytest.raises(TypeError, match=r'Duration\(seconds=60.0\)'):
        Buffer(cache_time=pandas.Timedelta('60s'))


@for_each(make=[
    convert.time_message,
    lambda stamp: convert.transform_stamped('a', 'b', stamp, POSE).header.stamp])
def test_every_stamp_of_a_message_goes_into_one_again_and_no_other_does(make):
    for stamp in (FIRST, -2**31 * SECOND + 1, -SECOND, -1, 0, 1, SECOND - 1, SECOND,
                  2**31 * SECOND - 1, LAST - 4 * SECOND, LAST - 3 * SECOND, LAST):
        message = make(stamp)
        assert stamp >= 2**31 * SECOND or message.nanosec < SECOND
        sent = deserialize_message(serialize_message(message), TimeMessage)
        assert convert.as_nanoseconds(sent) == stamp
    for stamp in (FIRST - 1, LAST + 1, 2**63 - 1, -2**63):
        with pytest.raises(InvalidArgumentException, match='no message can hold it'):
            make(stamp)


@for_each(stamp=[0, 17 * SECOND + 123_456_789, -1],
          place=[POSE[:3], (0.0, 0.0, 0.0), (math.pi, 1e300, -0.0)])
def test_message_has_the_sign_of_tf2_and_arrives_as_it_is(stamp, place):
    for values in [*np.random.default_rng(1).normal(size=(100, 4)), np.array(POSE[3:])]:
        q = so3.normalize(tuple(values.tolist()))
        message = convert.transform_stamped('Küche', '机器人/手', stamp, (*place, *q))
        arrived = deserialize_message(serialize_message(message), TransformStamped)
        assert arrived == message
        assert convert.as_sample(arrived) == Sample(
            'Küche', '机器人/手', stamp, (*place, *so3.with_tf2_sign(q)))


def test_message_becomes_a_sample_and_a_pose_and_back():
    message = convert.transform_stamped('map', 'base', 3 * SECOND + 5, POSE)
    assert convert.as_sample(message) == Sample('map', 'base', 3 * SECOND + 5, POSE)
    for form in (message, message.transform, convert.transform_message(Pose(*POSE)),
                 convert.transform_message(np.array(POSE))):
        assert convert.as_pose(form) == POSE
        assert isinstance(convert.as_pose(form), Pose)

    message.transform.translation.x, message.transform.rotation.w = 2, 1
    pose = convert.as_sample(message).pose
    assert pose == (2.0, *POSE[1:6], 1.0)
    assert {type(number) for number in pose} == {float}


@for_each(number=[1.5, 2, True, np.float64(2.0), np.int64(2), np.float32(2.0)],
          field=['translation.x', 'translation.z', 'rotation.x', 'rotation.w'])
def test_other_numbers_are_serialized_as_what_they_are(number, field):
    message = transform('a', 'b', seconds=4.0)
    part, axis = field.split('.')
    setattr(getattr(message.transform, part), axis, number)
    fixed = convert.with_float_fields(message)
    assert (fixed is message) == (type(number) is float)
    unchanged = getattr(getattr(message.transform, part), axis)
    assert unchanged is number, "the caller's value is unchanged"
    arrived = deserialize_message(serialize_message(fixed), TransformStamped)
    assert getattr(getattr(arrived.transform, part), axis) == float(number)
    assert (arrived.header, arrived.child_frame_id) == (message.header, 'b')
