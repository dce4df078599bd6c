# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Conversion between messages and numbers."""

import copy
from datetime import timedelta
import importlib
import math
from types import SimpleNamespace

from builtin_interfaces.msg import Duration as DurationMessage, Time as TimeMessage
from geometry_msgs.msg import Quaternion, Transform, TransformStamped
from inputs import for_each
import numpy as np
import pytest
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time
from ros_helpers import transform
from std_msgs.msg import Header
from tf_tree_py import Buffer, InvalidArgumentException, Pose
from tf_tree_py.core import Sample
from tf_tree_py.core.geometry import so3
from tf_tree_py.ros.messages import fast_messages

# Not imported from the package, where tf2's function of the same name hides it.
convert = importlib.import_module('tf_tree_py.ros.messages.convert')

NO_TIMES = [
    (0.5, r'0.5 is not a time: .*; a timeout of 0.5 s is Duration\(seconds=0.5\)'),
    (2, r'a timeout of 2 s is Duration\(seconds=2\)'),
    (timedelta(seconds=90), r'a timeout of 90.0 s is Duration\(seconds=90.0\)'),
    ('now', "'now' is not a time: .*Duration$"),
]
POSE = (1.0, -2.0, 3.5, 0.5, -0.5, 0.5, -0.5)
SECOND = 1_000_000_000


@pytest.mark.parametrize(('time', 'nanoseconds'), [
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
def test_every_kind_of_time_becomes_nanoseconds(time, nanoseconds):
    assert convert.as_nanoseconds(time) == nanoseconds
    assert type(convert.as_nanoseconds(time)) is int


@pytest.mark.parametrize('wrong', [None, 1, 1.5, '1', object(), SimpleNamespace(sec=1)])
def test_what_is_no_time_is_refused_with_a_hint(wrong):
    with pytest.raises(TypeError, match=r'is not a time: pass an rclpy\.time\.Time'):
        convert.as_nanoseconds(wrong)


@pytest.mark.parametrize('stamp', [0, 1, SECOND - 1, SECOND, -1, -SECOND, 2**31 * SECOND - 1,
                                   -2**31 * SECOND])
def test_nanoseconds_become_a_time_message_and_back(stamp):
    message = convert.time_message(stamp)
    assert 0 <= message.nanosec < SECOND
    assert convert.as_nanoseconds(message) == stamp


def transform_stamped_by(make_maker):
    """Return ``transform_stamped``, creating messages in one of the two ways."""
    def make(*values):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(convert, '_transform_stamped', make_maker(TransformStamped))
            return convert.transform_stamped(*values)

    return make


slotted_transform_stamped = transform_stamped_by(fast_messages.slotted_whole_maker)
public_transform_stamped = transform_stamped_by(fast_messages.public_whole_maker)


@pytest.mark.parametrize('make', [
    convert.time_message,
    lambda stamp: slotted_transform_stamped('a', 'b', stamp, POSE).header.stamp,
    lambda stamp: public_transform_stamped('a', 'b', stamp, POSE).header.stamp])
def test_every_stamp_of_a_message_goes_into_one_again_and_no_other_does(make):
    """Its nanoseconds may exceed a second, so it reaches 3.3 s further than its seconds."""
    first, last = -2**31 * SECOND, (2**31 - 1) * SECOND + 2**32 - 1
    for stamp in (first, 0, last - 4 * SECOND, last - 3 * SECOND, last):
        sent = deserialize_message(serialize_message(make(stamp)), TimeMessage)
        assert convert.as_nanoseconds(sent) == stamp
    for stamp in (first - 1, last + 1, 2**63 - 1, -2**63):
        with pytest.raises(InvalidArgumentException, match='no message can hold it'):
            make(stamp)


@for_each(stamp=[0, 1, 17 * SECOND + 123_456_789, -1],
          pose=[POSE, (0.0,) * 6 + (1.0,), (math.pi, 1e300, -0.0) + POSE[3:],
                (1.0, 2.0, 3.0, 0.1, -0.9, 0.3, 0.3), (1.0, 2.0, 3.0, 0.5, -0.1, 0.1, -0.85)],
          names=[('map', 'base_link'), ('a', ''), ('Küche', '机器人/手')])
def test_slotted_message_equals_the_public_one(names, pose, stamp):
    slotted = slotted_transform_stamped(*names, stamp, pose)
    public = public_transform_stamped(*names, stamp, pose)
    assert slotted == public
    assert repr(slotted) == repr(public)
    # Not byte by byte: the padding of CDR is uninitialised memory.
    assert len(serialize_message(slotted)) == len(serialize_message(public))
    assert deserialize_message(serialize_message(slotted), TransformStamped) == public
    assert copy.deepcopy(slotted) == public


@pytest.mark.parametrize('make', [slotted_transform_stamped, public_transform_stamped])
def test_quaternion_in_a_message_has_the_sign_of_tf2(make):
    for values in np.random.default_rng(1).normal(size=(300, 4)):
        q = so3.normalize(tuple(values.tolist()))
        rotation = make('a', 'b', 0, (0.0, 0.0, 0.0, *q)).transform.rotation
        assert (rotation.x, rotation.y, rotation.z, rotation.w) == so3.with_tf2_sign(q)


def test_slotted_message_is_as_good_as_any_to_its_owner():
    message = slotted_transform_stamped('a', 'b', SECOND, POSE)
    other = slotted_transform_stamped('a', 'b', SECOND, POSE)
    message.transform.translation.x = 9.0
    message.header.stamp.sec = 8
    message.header.frame_id = 'c'
    message.transform.rotation.w = 1.0
    message.header.stamp = TimeMessage(sec=5)
    message.transform.rotation = Quaternion(x=1.0)
    message.header = Header(frame_id='d')
    message.child_frame_id = 'e'
    message.transform = Transform()
    assert (other.transform.translation.x, other.header.stamp.sec) == (1.0, 1)
    assert deserialize_message(serialize_message(message), TransformStamped) == message


@pytest.fixture
def constructed(monkeypatch):
    """Return a list of the arguments of later calls of the constructor of ``Time``."""
    calls, construct = [], TimeMessage.__init__

    def noting(self, **values):
        calls.append(values)
        construct(self, **values)

    monkeypatch.setattr(TimeMessage, '__init__', noting)
    return calls


def test_slots_are_used_where_the_messages_have_those_known(constructed):
    convert.transform_stamped('a', 'b', SECOND, POSE)
    assert not constructed


@pytest.mark.parametrize('slots', [['_sec', '_nanosec'], ['_sec', '_nanosec', '_more'], [],
                                   [*TimeMessage.__slots__, '_new']])
def test_messages_with_other_slots_are_made_by_their_constructors(
        monkeypatch, constructed, slots):
    expected = convert.transform_stamped('a', 'b', SECOND, POSE)
    monkeypatch.setattr(TimeMessage, '__slots__', slots)
    made = transform_stamped_by(fast_messages.whole_maker)('a', 'b', SECOND, POSE)
    assert {'sec': 1, 'nanosec': 0} in constructed
    assert made == expected


def test_message_becomes_a_sample():
    message = convert.transform_stamped('map', 'base', 3 * SECOND + 5, POSE)
    assert convert.as_sample(message) == Sample('map', 'base', 3 * SECOND + 5, POSE)


def test_pose_is_read_from_a_transform_stamped_or_not():
    message = convert.transform_stamped('map', 'base', 0, POSE)
    for source in (message, message.transform):
        pose = convert.as_pose(source)
        assert isinstance(pose, Pose)
        assert pose == POSE


def test_pose_becomes_a_transform_message():
    assert convert.as_pose(convert.transform_message(Pose(*POSE))) == POSE
    assert convert.as_pose(convert.transform_message(np.array(POSE))) == POSE


def test_ints_in_a_message_are_read_as_numbers():
    message = transform('a', 'b')
    message.transform.translation.x = 2
    message.transform.rotation.w = 1
    pose = convert.as_sample(message).pose
    assert pose == (2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert {type(number) for number in pose} == {float}


def test_message_of_floats_is_passed_on_itself():
    message = transform('a', 'b', x=1.0)
    assert convert.with_float_fields(message) is message


@for_each(number=[2, True, np.float64(2.0), np.int64(2), np.float32(2.0)],
          field=['translation.x', 'translation.z', 'rotation.x', 'rotation.w'])
def test_other_numbers_are_serialized_as_what_they_are(number, field):
    message = transform('a', 'b', seconds=4.0)
    part, axis = field.split('.')
    setattr(getattr(message.transform, part), axis, number)
    fixed = convert.with_float_fields(message)
    unchanged = getattr(getattr(message.transform, part), axis)
    assert unchanged is number, "the caller's value is unchanged"
    arrived = deserialize_message(serialize_message(fixed), TransformStamped)
    assert getattr(getattr(arrived.transform, part), axis) == float(number)
    assert (arrived.header, arrived.child_frame_id) == (message.header, 'b')


@pytest.mark.parametrize(('given', 'match'), NO_TIMES)
def test_what_is_no_time_is_answered_with_what_to_write(given, match):
    with pytest.raises(TypeError, match=match):
        convert.as_nanoseconds(given)
    with pytest.raises(TypeError, match=match):
        Buffer().lookup_transform('map', 'base', Time(), given)
    with pytest.raises(TypeError, match=match):
        Buffer().wait_for_transform_async('map', 'base', Time(), timeout=given)


def test_timedelta_of_pandas_is_no_time():
    pandas = pytest.importorskip('pandas')
    # Its attribute .nanoseconds is the remainder below a microsecond: 0.
    with pytest.raises(TypeError, match=r'Duration\(seconds=60.0\)'):
        Buffer(cache_time=pandas.Timedelta('60s'))
