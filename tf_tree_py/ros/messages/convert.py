# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Conversions between ROS messages and core's plain numbers: times, samples, transforms.

The messages that lookups do not use are in ``geometry``.
"""

from collections.abc import Callable
from datetime import timedelta
from typing import Any, TypeAlias

from builtin_interfaces.msg import Duration as DurationMessage, Time as TimeMessage
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.time import Time
from std_msgs.msg import Header
from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.geometry.se3 import PoseTuple
from tf_tree_py.core.geometry.so3 import has_tf2_sign
from tf_tree_py.core.messages.message_layout import Rename
from tf_tree_py.core.messages.sample import as_sec_nanosec, ImpossibleStamp, Sample
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND, UNLIMITED

from .fast_messages import whole_maker

TimeLike: TypeAlias = Time | TimeMessage
"""A stamp: rclpy's, or a message's ``header.stamp``."""

DurationLike: TypeAlias = Duration | DurationMessage
"""A duration of rclpy, or a message's."""

SpanLike: TypeAlias = DurationLike | int | None
"""A duration, ``UNLIMITED``, or None for a default; no other number, since it has no unit."""

_ROS_TIME = ClockType.ROS_TIME.value
_STEADY_TIME = ClockType.STEADY_TIME.value
# Nanoseconds, thirty years.
_LONGEST_UPTIME = 10**18


def as_nanoseconds(time: Any, expected: type[Duration | Time] = Duration) -> int:
    """
    Return a time or a duration as integer nanoseconds.

    :param time: an rclpy ``Time`` or ``Duration``, their messages, or anything with
        ``nanoseconds`` or with ``sec`` and ``nanosec``.
    :param expected: what is named in the error.
    :raises TypeError: none of these, as in tf2: a caller would take a TransformException for a
        transform that is not available yet.
    """
    nanoseconds = getattr(time, 'nanoseconds', None)
    # A Timedelta of pandas has an attribute nanoseconds, but it is only the last three digits.
    if nanoseconds is None or isinstance(time, timedelta):
        try:
            nanoseconds = time.sec * NANOSECONDS_PER_SECOND + time.nanosec
        except AttributeError:
            what_to_pass = ('a time: pass a header.stamp or an rclpy.time.Time'
                            if expected is Time else 'a duration: pass an rclpy.duration.Duration')
            raise TypeError(
                f'{time!r} is not {what_to_pass}{_in_seconds(time, expected)}') from None
    return nanoseconds  # type: ignore[no-any-return]


def nanoseconds_or_none(duration: DurationLike | None) -> int | None:
    """Return a duration as nanoseconds; None stays None."""
    return None if duration is None else as_nanoseconds(duration)


def as_span(given: SpanLike, name: str = 'cache_time') -> int | None:
    """
    Return a span that may be ``UNLIMITED`` as nanoseconds; None stays None.

    :param name: that of the argument, for the error.
    :raises TypeError: a number, because it has no unit; ``UNLIMITED`` is accepted.
    """
    if given is None or given == UNLIMITED:
        return None if given is None else UNLIMITED
    if isinstance(given, int | float):
        unit = 'nanoseconds' if isinstance(given, int) and given >= 10**6 else 'seconds'
        raise TypeError(
            f'{name}={given} is not a time, because it has no unit: pass an '
            'rclpy.duration.Duration, such as '
            f'Duration({unit}={given}), or UNLIMITED')
    if isinstance(given, Time | TimeMessage):
        raise TypeError(f'{name}={given!r} is a point in time: pass an rclpy.duration.Duration')
    return as_nanoseconds(given)


def _in_seconds(time: object, expected: type[Duration | Time]) -> str:
    """Return how to write a number of seconds as a ``Duration`` or a ``Time``."""
    seconds = time.total_seconds() if isinstance(time, timedelta) else time
    if isinstance(seconds, bool) or not isinstance(seconds, float | int):
        return ''
    return f'; {seconds} s is {expected.__name__}(seconds={seconds})'


def as_stamp(time: Any, is_simulated: Callable[[], bool]) -> int:
    """
    Return a time to look up as integer nanoseconds.

    Zero is the latest, whatever its clock.

    :param time: an rclpy ``Time``, or a message's, or as ``as_nanoseconds`` takes them.
    :param is_simulated: returns whether ROS time differs from the system's.
    :raises TypeError: none of these.
    :raises InvalidArgumentException: a ``Time`` of another clock than that of the stamps.
    """
    if type(time) is TimeMessage:  # the common case
        return time.sec * NANOSECONDS_PER_SECOND + time.nanosec  # type: ignore[no-any-return]
    stamp = as_nanoseconds(time, Time)
    # Reading the clock type costs as much as the rest of this function. Steady time counts from
    # the start of the machine, so it is a small number; system time is wrong only if time is
    # simulated.
    if isinstance(time, Time) and stamp and (stamp < _LONGEST_UPTIME or is_simulated()):
        # Comparing rclpy's enumerations is several times slower.
        clock_type = time.clock_type.value
        if clock_type != _ROS_TIME and (clock_type == _STEADY_TIME or is_simulated()):
            raise InvalidArgumentException(_other_clock(time))
    return stamp


def _other_clock(time: Time) -> str:
    why = ('counts from when the machine started' if time.clock_type.value == _STEADY_TIME
           else 'is not that of the stamps while time is simulated')
    return (f'{time!r} is of a clock that {why}: pass the header.stamp of the message that you '
            'work on, node.get_clock().now(), or Time() for the latest. A Time that you create '
            'yourself needs clock_type=ClockType.ROS_TIME')


def time_message(stamp: int) -> TimeMessage:
    """
    Return nanoseconds as a ``builtin_interfaces/Time``.

    :raises InvalidArgumentException: no message can hold them.
    """
    sec, nanosec = as_sec_nanosec(stamp)
    return TimeMessage(sec=sec, nanosec=nanosec)


def as_sample(message: TransformStamped) -> Sample:
    """Return a ``TransformStamped`` as a sample, with frames without leading slashes."""
    sample = as_moving_sample(message)
    if isinstance(sample, Sample):
        return sample
    parent, child, sec, nanosec = sample
    return Sample(parent, child, sec * NANOSECONDS_PER_SECOND + nanosec,
                  _pose_tuple(message.transform))


def as_moving_sample(message: TransformStamped) -> Sample | ImpossibleStamp:
    """Return the same, or the stamp if it is impossible, which is no fault of a static one."""
    try:
        header = message.header
    except AttributeError:
        raise TypeError(_no_transform(message)) from None
    time = header.stamp
    try:
        sec, nanosec = time.sec, time.nanosec
    except AttributeError:  # it should be a message, but tf2 accepts a Time of rclpy too
        sec, nanosec = divmod(as_nanoseconds(time, Time), NANOSECONDS_PER_SECOND)
    parent, child = header.frame_id.removeprefix('/'), message.child_frame_id.removeprefix('/')
    if nanosec >= NANOSECONDS_PER_SECOND:
        return ImpossibleStamp(parent, child, sec, nanosec)
    return Sample(parent, child, sec * NANOSECONDS_PER_SECOND + nanosec,
                  _pose_tuple(message.transform))


def _no_transform(given: object) -> str:
    what = f'a TransformStamped is needed, and this is a {type(given).__name__}'
    if isinstance(given, list | tuple):
        return f'{what}: call set_transform for each of its items'
    if hasattr(given, 'transforms'):
        return f'{what}: call set_transform for each of its transforms'
    return what


def as_pose(transform: Transform | TransformStamped) -> Pose:
    """Return the ``Pose`` of a ``Transform`` or ``TransformStamped``."""
    return Pose._make(_pose_tuple(getattr(transform, 'transform', transform)))


def _pose_tuple(transform: Transform) -> PoseTuple:
    t, q = transform.translation, transform.rotation
    # rclpy accepts an int in a float field, but serializes it as another number.
    return (float(t.x), float(t.y), float(t.z),
            float(q.x), float(q.y), float(q.z), float(q.w))


def with_float_fields(message: TransformStamped) -> TransformStamped:
    """
    Return the message itself, or, if it holds ints, a copy with floats.

    rclpy serializes the memory of an int as if it were a double, so
    ``translation.x = 1`` would be published as about 5e-324.
    """
    t, q = message.transform.translation, message.transform.rotation
    if all(type(number) is float for number in (t.x, t.y, t.z, q.x, q.y, q.z, q.w)):
        return message
    return TransformStamped(header=message.header, child_frame_id=message.child_frame_id,
                            transform=transform_message(_pose_tuple(message.transform)))


def with_frames(message: TransformStamped, names: Rename) -> TransformStamped:
    """Return the message itself, or a copy if its frames get other names."""
    header = message.header
    edge = names(header.frame_id, message.child_frame_id)
    if edge is None or edge == (header.frame_id, message.child_frame_id):
        return message
    parent, child = edge
    return TransformStamped(header=Header(stamp=header.stamp, frame_id=parent),
                            child_frame_id=child, transform=message.transform)


def transform_message(pose: PoseTuple) -> Transform:
    """Return a pose as a ``geometry_msgs/Transform``."""
    x, y, z, qx, qy, qz, qw = map(float, pose)
    return Transform(translation=Vector3(x=x, y=y, z=z),
                     rotation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def transform_stamped(frame_id: str, child_frame_id: str, stamp: int,
                      pose: PoseTuple) -> TransformStamped:
    """
    Return a ``TransformStamped``; its quaternion has the sign that tf2's would have.

    :param pose: seven floats; other numbers are not converted.
    :raises InvalidArgumentException: a stamp that no message can hold.
    """
    sec, nanosec = divmod(stamp, NANOSECONDS_PER_SECOND)
    if sec.bit_length() > 31:  # seldom; a call each time would cost as much as this line
        sec, nanosec = as_sec_nanosec(stamp)
    x, y, z, qx, qy, qz, qw = pose
    # With w > 0.5 the sign is always tf2's, and no call is needed to see that.
    if not (qw > 0.5 or has_tf2_sign(qx, qy, qz, qw)):
        qx, qy, qz, qw = -qx, -qy, -qz, -qw
    return _transform_stamped(sec, nanosec, frame_id, child_frame_id, x, y, z, qx, qy, qz, qw)


_transform_stamped = whole_maker(TransformStamped)
