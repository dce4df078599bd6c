# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot from a recorder's view: any rates, jitter, delays and clock; healthy or with a fault."""

from dataclasses import dataclass, field
from operator import attrgetter

import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.core.messages.observers import ReceivedMessage
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.doctor import Doctor

SECOND = 10**9
BEGIN = 1_700_000_000
NEVER = -2e9


@dataclass
class Edge:
    """
    Samples of one edge.

    :ivar stamps: (N,) seconds since the start, by the robot's clock; ``NEVER``: zero.
    :ivar received: (N,) the same by the recorder's clock.
    :ivar poses: (N, 7).
    :ivar sender: edges of one sender share its clock.
    """

    parent: str
    child: str
    stamps: np.ndarray
    received: np.ndarray
    poses: np.ndarray
    sender: str
    static: bool = False


@dataclass
class Robot:
    """
    The properties that vary between robots.

    :ivar pace: the rate of its clock relative to the recorder's; 1 if not ``simulated``: equal.
    :ivar simulated: whether its stamps begin at zero.
    :ivar seconds: the duration of the recording, by its own clock.
    :ivar jitter: of the time of each sample, as a fraction of the interval.
    :ivar delay: the maximum latency of a message, seconds of the recorder.
    :ivar tolerance: how far the localiser post-dates, seconds.
    :ivar speed: metres a second.
    :ivar lead: what to add to a time for its stamp, seconds.
    :ivar authority: the name of all publishers.
    """

    seed: int = 0
    pace: float = 1.0
    simulated: bool = False
    seconds: float = 20.0
    localiser_hz: float = 10.0
    wheels_hz: float = 50.0
    arm_hz: float = 50.0
    jitter: float = 0.1
    delay: float = 0.01
    tolerance: float = 0.0
    speed: float = 1.0
    lead: float = 0.0
    authority: str = ''
    edges: dict[str, Edge] = field(default_factory=dict)

    def __post_init__(self):
        self.rng = np.random.default_rng(self.seed)
        self.add('map', 'odom', self.localiser_hz, self.corrections, 'amcl', self.tolerance)
        self.add('odom', 'base', self.wheels_hz, self.drive, 'wheels')
        self.add('base', 'arm', self.arm_hz, self.swing, 'arm')
        self.add('arm', 'tool', self.arm_hz, self.swing, 'arm')
        base = np.zeros((1, 7))
        base[:, 6] = 1.0
        self.edges['lidar'] = Edge('base', 'lidar', np.zeros(1), np.array([-0.2]), base, 'urdf',
                                   static=True)

    def add(self, parent, child, rate_hz, poses, sender, lead=0.0):
        """Add an edge with samples at a rate, with jitter."""
        times = np.arange(0.0, self.seconds, 1.0 / rate_hz)
        times = times + self.jitter / rate_hz * self.rng.uniform(-0.5, 0.5, len(times))
        delays = self.delay * self.rng.uniform(0.1, 1.0, len(times))
        # A message does not overtake the previous one.
        received = np.maximum.accumulate(times / self.pace + delays)
        self.edges[child] = Edge(parent, child, times + lead, received, poses(times), sender)

    def drive(self, t):
        return planar(self.speed * 3.0 * np.sin(t / 3.0), 0.3 * self.speed * t,
                      0.4 * np.sin(0.7 * t))

    def swing(self, t):
        poses = np.zeros((len(t), 7))
        poses[:, 2] = 0.3
        poses[:, 3], poses[:, 6] = np.sin(0.15 * np.sin(2.0 * t)), np.cos(0.15 * np.sin(2.0 * t))
        return poses

    def corrections(self, t):
        return planar(0.002 * np.floor(t), 0.0 * t, 0.001 * np.floor(t))

    @property
    def origin(self):
        """Return the first stamp, seconds."""
        return 10 if self.simulated else BEGIN

    def messages(self):
        """Return the messages that a recorder receives, in order."""
        messages = []
        for edge in self.edges.values():
            stamps, received = (np.rint((begin + times) * SECOND).astype(np.int64)
                                for begin, times in ((self.origin, edge.stamps),
                                                     (BEGIN, edge.received)))
            stamps = np.where(edge.static, 0, np.maximum(stamps, 0)).tolist()
            topic = '/tf_static' if edge.static else '/tf'
            # The messages of a publisher share the names, as those that the buffer reads do.
            names, poses = [(edge.parent, edge.child)], edge.poses.tobytes()
            size = len(poses) // max(len(edge.poses), 1)
            messages += [
                ReceivedMessage(Batch(names, [stamp], [poses[begin:begin + size]]), arrived,
                                topic, edge.static, self.authority)
                for stamp, arrived, begin in zip(
                    stamps, received.tolist(), range(0, len(poses), size or 1), strict=True)]
        return sorted(messages, key=attrgetter('received'))

    def findings(self, doctor=None):
        """Return a doctor's findings."""
        doctor = doctor or Doctor()
        buffer = BufferCore(doctor.limits.cache_time)
        buffer.observers.add(doctor)
        for message in self.messages():
            buffer.observers.notify_received(message)
            buffer.insert_batch(message.batch, message.authority, message.static,
                                announced=True)
        return doctor.findings()


def planar(x, y, yaw):
    """Return (N, 7) poses on the plane."""
    poses = np.zeros((len(x), 7))
    poses[:, 0], poses[:, 1] = x, y
    poses[:, 5], poses[:, 6] = np.sin(yaw / 2.0), np.cos(yaw / 2.0)
    return poses


# --- one fault each: functions of a robot and of the size of the fault, from 0 to 1

def outliers(robot, size):
    """Set the wheels' odometry to the origin for one sample, every 25 to 1500 samples."""
    edge = robot.edges['base']
    edge.poses[:, 1] += 4.0
    every = round(25 * 60.0 ** size)
    edge.poses[min(every, len(edge.poses) // 2)::every] = planar(*np.zeros((3, 1)))


def too_fast(robot, size):
    """Use millimetres in the wheels' odometry."""
    times = robot.edges['base'].stamps
    robot.edges['base'].poses = planar((200.0 + 2000.0 * size) * times, 0.0 * times, 0.0 * times)


def clock_step(robot, size):
    """Step the clock of the computer that sends the arm."""
    step = (1 if robot.rng.random() < 0.5 else -1) * (0.5 + 2.0 * size)
    for child in ('arm', 'tool'):
        edge = robot.edges[child]
        edge.stamps = edge.stamps + step * (edge.stamps > 0.5 * robot.seconds)


def frozen_stamp(robot, size):
    """Stop the localiser's input of scans at some time."""
    edge = robot.edges['odom']
    edge.stamps = np.minimum(edge.stamps, (0.1 + 0.5 * size) * robot.seconds)


def two_publishers(robot, size):
    """Add another publisher of the wheels' edge, slightly later and offset."""
    edge = robot.edges['base']
    shift, apart = 0.5 / robot.wheels_hz, 0.2 + size + 10.0 * robot.speed / robot.wheels_hz
    other = edge.poses.copy()
    other[:, 0] += apart
    edge.stamps = np.concatenate([edge.stamps, edge.stamps + shift])
    edge.received = np.concatenate([edge.received, edge.received + shift / robot.pace])
    edge.poses = np.concatenate([edge.poses, other])


def clock_drift(robot, size):
    """Slow the clock that stamps the tool."""
    robot.edges['tool'].stamps = (0.98 - 0.1 * size) * robot.edges['tool'].stamps


def clock_offset(robot, size):
    """Delay the clock of the computer that sends the arm."""
    for child in ('arm', 'tool'):
        robot.edges[child].stamps = robot.edges[child].stamps - (0.2 + 2.0 * size)


def future_stamps(robot, size):
    """Advance the clock of the computer that sends the arm."""
    for child in ('arm', 'tool'):
        robot.edges[child].stamps = robot.edges[child].stamps + (0.2 + 2.0 * size)


def whole_seconds(robot, size):
    """Omit nanosec in the driver of the arm."""
    robot.edges['arm'].stamps = np.floor(robot.edges['arm'].stamps)


def stale(robot, size):
    """Stop the wheels' odometry."""
    keep(robot.edges['base'], robot.edges['base'].stamps < (0.2 + 0.3 * size) * robot.seconds)


def gap(robot, size):
    """Pause the wheels' odometry for a while."""
    edge = robot.edges['base']
    begin, end = (0.3 - 0.1 * size) * robot.seconds, (0.6 + 0.2 * size) * robot.seconds
    keep(edge, (edge.stamps < begin) | (edge.stamps > end))


def keep(edge, which):
    """Remove the other samples of an edge."""
    edge.stamps, edge.received, edge.poses = (
        column[which] for column in (edge.stamps, edge.received, edge.poses))


def pose_jump(robot, size):
    """Reset the wheels' odometry to another place, from which it continues."""
    edge = robot.edges['base']
    edge.poses[edge.stamps > 0.5 * robot.seconds, 0] += 20.0 + 100.0 * size


def unconnected(robot, size):
    """Disconnect the arm from the robot."""
    for edge in robot.edges.values():
        edge.parent = 'bench' if edge.child == 'arm' else edge.parent


FAULTS = {fault.__name__: fault for fault in (
    outliers, too_fast, clock_step, frozen_stamp, two_publishers, clock_offset, future_stamps,
    whole_seconds, stale, gap, pose_jump, unconnected, clock_drift)}
