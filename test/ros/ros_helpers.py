# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Helpers of the tests of the ROS layer: messages, and waiting for futures and conditions."""

import threading

from conditions import until
from geometry_msgs.msg import TransformStamped
from programs import PATIENCE_S
from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.time import Time
from rclpy.time_source import TimeSource
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage
from tf_tree_py import StaticTransformBroadcaster, TransformBroadcaster

PATIENCE = Duration(seconds=PATIENCE_S)
LATEST = Time()
# In the text of an error, with any duration.
WAITED = r'\(waited \d+\.\d{3} s for it\)'
SIM_TIME = {'parameter_overrides': [Parameter('use_sim_time', value=True)]}

_SECOND = 10**9
# The range of the stamp of a message, nanoseconds; then stamps around it.
FIRST, LAST = -2**31 * _SECOND, (2**31 - 1) * _SECOND + 2**32 - 1
FAR_STAMPS = [-2**63 + _SECOND, FIRST - 1, FIRST, -_SECOND, -1, 1, LAST, LAST + 1,
              2**63 - 1 - _SECOND]


class Moment:
    """A time that is not one of rclpy."""

    def __init__(self, nanoseconds):
        self.nanoseconds = nanoseconds


def at(seconds):
    """Return a ``Time`` on the ROS clock, simulated or not."""
    return Time(nanoseconds=round(seconds * 1e9), clock_type=ClockType.ROS_TIME)


def lasting(seconds):
    """Return seconds as a ``Duration``."""
    return Duration(nanoseconds=round(seconds * 1e9))


def transform(parent, child, seconds=1.0, x=0.0, **rotation):
    """Return a ``TransformStamped`` with a translation along x."""
    message = TransformStamped()
    message.header.frame_id = parent
    message.header.stamp = at(seconds).to_msg()
    message.child_frame_id = child
    message.transform.translation.x = x
    for name, value in rotation.items():
        setattr(message.transform.rotation, name, value)
    return message


def move(buffer, seconds, parent='map', child='base'):
    """Insert a sample of an edge, at x = seconds."""
    buffer.set_transform(transform(parent, child, seconds, x=seconds), 'me')


def with_a_lamp(buffer):
    """Fill a buffer with map -> odom -> base -> arm and a lamp on odom, at 1 s and 3 s."""
    for parent, child in (('map', 'odom'), ('odom', 'base'), ('base', 'arm'), ('odom', 'lamp')):
        for second in (1, 3):
            buffer.set_transform(transform(parent, child, second, x=float(second)), 'test')
    assert buffer.statistics().accepted == 8
    return buffer


def until_subscribed(node):
    """Wait until each publisher of transforms of a node has a subscription."""
    until(lambda: all(publisher.get_subscription_count() for publisher in node.publishers
                      if publisher.topic_name in ('/tf', '/tf_static')))


def until_waiting(buffer, count=1):
    """Wait until this number of threads wait in a buffer."""
    until(lambda: len(buffer.waiting) >= count)


def receivers():
    """Return the threads that receive transforms."""
    return [thread for thread in threading.enumerate() if thread.name.endswith(' receiver')]


def x_of(message):
    return message.transform.translation.x


def ended(future):
    """Return an event that is set when a future, of any kind, ends."""
    event = threading.Event()
    future.add_done_callback(lambda _: event.set())
    return event


def result_of(future):
    """Wait until a future of any kind ends; return its result, or raise its exception."""
    assert ended(future).wait(PATIENCE_S)
    return future.result()


class Talker:
    """Publishes transforms when there is a subscription: a volatile topic drops earlier ones."""

    def __init__(self, node):
        self.node = node
        self._dynamic = self._static = self._raw = None

    def move(self, *transforms, listeners=1, into=None):
        """Publish; return when a buffer has them, if one is given."""
        if self._dynamic is None:
            self._dynamic = TransformBroadcaster(self.node)
        self.until_heard(self._dynamic.pub_tf, listeners)
        self._dynamic.sendTransform(transforms)
        _until_in(into, transforms)

    def fix(self, *transforms, into=None):
        """Publish static ones; return when a buffer has them, if one is given."""
        if self._static is None:
            self._static = StaticTransformBroadcaster(self.node)
        self._static.sendTransform(transforms)
        _until_in(into, transforms)

    def send(self, message, topic='/tf', listeners=1):
        """Publish a TFMessage, or bytes that are sent unchanged."""
        if self._raw is None or self._raw.topic_name != topic:
            self._raw = self.node.create_publisher(TFMessage, topic, 1000)
        self.until_heard(self._raw, listeners)
        self._raw.publish(message)

    def until_heard(self, publisher, listeners=1):
        until(lambda: publisher.get_subscription_count() >= listeners)


def _until_in(buffer, transforms):
    for each in transforms if buffer is not None else ():
        header = each.header
        buffer.lookup_transform(header.frame_id, each.child_frame_id, header.stamp, PATIENCE)


def simulated_clock(seconds=0.0):
    """Return a clock of simulated time without a node; ``set_ros_time_override`` sets it."""
    clock, source = ROSClock(), TimeSource()
    source.ros_time_is_active = True
    source.attach_clock(clock)
    clock.set_ros_time_override(at(seconds))
    return clock


class SimClock:
    """Publishes /clock."""

    def __init__(self, node):
        self.publisher = node.create_publisher(Clock, '/clock', 10)

    def show(self, seconds, *buffers):
        """Set the time, and wait until the buffers use it."""
        until(lambda: self.publisher.get_subscription_count() >= len(buffers))
        self.publisher.publish(Clock(clock=at(seconds).to_msg()))
        for buffer in buffers:
            until(lambda buffer=buffer: simulated_seconds(buffer) == seconds)


def simulated_seconds(buffer):
    """Return the simulated time that a buffer uses; None if it uses the wall clock."""
    now = buffer.timeouts.watch.simulated_now()
    return None if now is None else now / 1e9
