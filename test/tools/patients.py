# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Robots that are healthy, and robots with one fault each, as messages of a bag."""

import math
import struct

from bags import BEST_EFFORT, JAZZY, LATCHED, Message, SECOND, UNKNOWN, write_ros2
import numpy as np
from serialized import serialize
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.reports.switch_status import as_values

BEGIN = 1_700_000_000 * SECOND
SECONDS = 8.0
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def ns(seconds):
    return round(seconds * SECOND)


def drive(t):
    """Return a pose on a curve on the plane."""
    return Pose.from_xyz_rpy(x=math.sin(t), y=0.3 * t, yaw=0.4 * math.sin(0.7 * t))


def swing(t):
    """Return a pose that swings like a joint."""
    return Pose.from_xyz_rpy(z=0.3, roll=0.3 * math.sin(2.0 * t), pitch=0.2 * math.cos(t))


def at(x=0.0, yaw=0.0):
    """Return a function with a constant pose."""
    pose = Pose.from_xyz_rpy(x=x, yaw=yaw)
    return lambda t: pose


def drift(t):
    """Return small repeated corrections of an odometry, like a localiser's."""
    return Pose.from_xyz_rpy(x=0.002 * math.floor(2.0 * t), yaw=0.001 * math.floor(t))


def send(*edges, rate_hz=50.0, begin=0.0, end=SECONDS, delay=0.004, stamp=lambda t: t,
         topic='/tf', times=None, jitter=0.0005, qos=''):
    """
    Return messages with the same edges at a rate.

    :param edges: (parent, child, pose as a function of the time in seconds).
    :param delay: from the time to the arrival, seconds.
    :param stamp: the stamp as a function of the time, both in seconds.
    """
    rng = np.random.default_rng(len(edges) + round(rate_hz))
    if times is None:
        times = np.arange(begin, end, 1.0 / rate_hz)
    return [Message(
        BEGIN + ns(t + delay + jitter * rng.random()), topic,
        [(parent, child, BEGIN + ns(stamp(t)), tuple(pose(t))) for parent, child, pose in edges],
        qos) for t in times]


def fixed(*edges, begin=-0.5, topic='/tf_static', qos=LATCHED):
    """Return one message with static edges."""
    return send(*edges, times=[begin], topic=topic, qos=qos)


# --- a robot on wheels, without fault

LOCALISER = send(('map', 'odom', drift), rate_hz=20.0)
WHEELS = send(('odom', 'base_link', drive))
ARM = send(('base_link', 'arm', swing), ('arm', 'tool', swing), rate_hz=50.0)
SENSORS = fixed(('base_link', 'lidar', at(0.3)), ('base_link', 'camera', at(0.2, 0.1)))
ROBOT = LOCALISER + WHEELS + ARM + SENSORS


def clock(at_rate=0.5, first=10.0):
    """Return messages on /clock of a simulation that is slower than real time."""
    ticks = []
    for t in np.arange(-1.0, SECONDS + 1.0, 0.05):
        sec, nanosec = divmod(ns(first + at_rate * t), SECOND)
        ticks.append(Message(BEGIN + ns(t), '/clock', [], type_name='rosgraph_msgs/msg/Clock',
                             data=b'\0\1\0\0' + struct.pack('<iI', sec, nanosec)))
    return ticks


def simulated(messages, at_rate=0.5, first=10.0):
    """Return messages with the stamps of that simulation."""
    return [message._replace(transforms=[
        (parent, child, ns(first) + round((stamp - BEGIN) * at_rate), pose)
        for parent, child, stamp, pose in message.transforms]) for message in messages]


def humanoid():
    """Return 30 joints in one message, some of them at rest, below a swaying pelvis."""
    joints = [(f'link_{number}', f'link_{number + 1}',
               swing if number % 3 else at(0.1)) for number in range(30)]
    return [*send(('odom', 'pelvis', lambda t: drive(t) @ swing(t))),
            *send(('pelvis', 'link_0', swing), *joints, rate_hz=50.0),
            *fixed(('link_30', 'hand', at(0.1)), ('pelvis', 'imu', at(0.05)))]


def warehouse_robot():
    """Return a robot whose localiser post-dates by a second, as AMCL does."""
    return [*send(('map', 'odom', drift), rate_hz=20.0, stamp=lambda t: t + 1.0),
            *WHEELS, *SENSORS]


def drone():
    """Return a fast and tilting drone at 200 Hz, with a gimbal."""
    return [*send(('map', 'base_link', lambda t: Pose.from_xyz_rpy(
                x=12.0 * t, z=5.0 + math.sin(t), roll=0.5 * math.sin(3.0 * t), yaw=t)),
                rate_hz=200.0),
            *send(('base_link', 'gimbal', swing), rate_hz=100.0),
            *fixed(('gimbal', 'camera', at(0.02)))]


def two_robots():
    """Return two robots with prefixes, each with its own tree."""
    return [message for prefix in ('robot1/', 'robot2/')
            for message in (*send((f'{prefix}odom', f'{prefix}base_link', drive)),
                            *fixed((f'{prefix}base_link', f'{prefix}lidar', at(0.3))))]


def simulation():
    """Return a robot whose stamps follow a /clock at half the pace of real time."""
    return [*clock(), *simulated(ROBOT)]


def of_another_recorder():
    """Return a robot without recorded quality of service of its publishers."""
    return [message._replace(qos=UNKNOWN) for message in ROBOT]


HEALTHY = {each.__name__: each for each in (
    humanoid, warehouse_robot, drone, two_robots, simulation, of_another_recorder)}


# --- one fault each

def _numbered(messages, change):
    """Return messages of one edge, changed by (number, stamp, pose) -> (stamp, pose)."""
    changed = []
    for number, message in enumerate(messages):
        (parent, child, stamp, pose), = message.transforms
        changed.append(message._replace(
            transforms=[(parent, child, *change(number, stamp, pose))]))
    return changed


def _with_impossible_stamps(messages):
    """Return messages of one edge, of which one in ten has a nanosec that wrapped below zero."""
    return [message._replace(data=serialize([
        (parent, child, stamp // SECOND, 2**32 - 1_000_000, pose)
        for parent, child, stamp, pose in message.transforms])) if number % 10 == 5 else message
        for number, message in enumerate(messages)]


def _bad(parent, child):
    return Message(BEGIN + ns(1.01), '/tf', [(parent, child, BEGIN + ns(1.0), STILL)])


def _looped():
    """Return two passes of a recording that is played in a loop."""
    again = [message._replace(received=message.received + ns(SECONDS))
             for message in LOCALISER + WHEELS]
    return [*LOCALISER, *WHEELS, *again, *SENSORS]


def _jumping(t):
    return Pose.from_xyz_rpy(x=math.sin(t) + (2.0 if t > 4.0 else 0.0), y=0.3 * t)


def _alternating(t):
    return Pose.from_xyz_rpy(x=math.sin(t) + 0.2, y=0.3 * t, yaw=0.05)


IRREGULAR = np.cumsum(np.resize([0.005, 0.09, 0.01, 0.005, 0.06], 200))


def _diagnosed(buffer):
    """Return the diagnostics of a node with a buffer about its sources, two messages."""
    array, status, header, time, pair = (JAZZY.types[name] for name in (
        'diagnostic_msgs/msg/DiagnosticArray', 'diagnostic_msgs/msg/DiagnosticStatus',
        'std_msgs/msg/Header', 'builtin_interfaces/msg/Time', 'diagnostic_msgs/msg/KeyValue'))
    values = [pair(key, value) for key, value in as_values(
        buffer.sources_of('base_link')).items()]
    data = bytes(JAZZY.serialize_cdr(array(header(time(0, 0), ''), [
        status(0, 'robot: tf', '14 frames', '/robot', []),
        status(1, 'robot: tf odom -> base_link', 'was replaced', '/robot', values)]),
        array.__msgtype__))
    return [Message(BEGIN + ns(t), '/diagnostics', [], type_name=array.__msgtype__, data=data)
            for t in (3.0, 4.0)]


def switched(code, buffer, show=lambda now: None):
    """
    Fill a buffer from sources until it has replaced one of them; return the buffer.

    :param show: is called with the time of each step, nanoseconds.
    """
    gate, says = SWITCHED[code]
    for t in np.arange(0.0, 4.0, 0.02):
        show(BEGIN + ns(t))
        for name, pose in says.items():
            if pose(t) is not None:
                buffer.insert_from(name, 'odom', 'base_link', BEGIN + ns(t), pose(t))
        if not t:
            buffer.switch_by_rule('base_link', max_age=SECOND // 2, gate=gate)
    return buffer


def _slip(t):
    return drive(t) @ Pose(x=max(0.0, t - 2.0))


# For each code, the gate of the buffer, and the poses of its sources over time.
SWITCHED = {
    'source_silent': (None, {'wheels': lambda t: drive(t) if t < 2.0 else None,
                             'visual': drive}),
    'source_diverged': ((0.05, 0.05), {'wheels': _slip, 'visual': drive, 'lidar': drive}),
}

FAULTY = {
    'loop': [*ROBOT, *send(('tool', 'base_link', swing), begin=1.0, end=1.5)],
    'two_parents': [*ROBOT, *send(('map', 'base_link', drive), delay=0.011)],
    'two_publishers': [*LOCALISER, *WHEELS, *SENSORS,
                       *(message._replace(publisher='another') for message in send(
                           ('odom', 'base_link', _alternating), rate_hz=20.0,
                           stamp=lambda t: t + 0.003))],
    'unconnected': [*ROBOT, *send(('gripper', 'finger', swing), rate_hz=50.0)],
    'delayed': [*LOCALISER, *send(
        ('odom', 'base_link', drive), rate_hz=8.0, delay=0.8, jitter=0.1,
        end=SECONDS - 0.8), *SENSORS],
    'static_republished': [*ROBOT, *send(('base_link', 'imu', at(0.1)), rate_hz=20.0)],
    'static_changed': [*ROBOT, *fixed(('base_link', 'lidar', at(0.35)), begin=3.0)],
    'late_joiner': [*LOCALISER, *WHEELS,
                    *fixed(('base_link', 'lidar', at(0.3)), begin=0.1, qos='')],
    'interpolated_jump': [
        *send(('map', 'odom', lambda t: at(0.6 if t > 4.0 else 0.0)(t)), rate_hz=2.0),
        *WHEELS, *SENSORS],
    'planar_only': [*send(('map', 'odom', swing)), *WHEELS, *SENSORS],
    'similar_names': [*ROBOT, *fixed(('baselink', 'imu', at(0.1)))],
    'leading_slash': [*ROBOT, *fixed(('/base_link', '/imu', at(0.1)))],
    'empty_name': [*ROBOT, _bad('', 'arm')],
    'self_edge': [*ROBOT, _bad('arm', 'arm')],
    'not_finite': [*LOCALISER, *_numbered(WHEELS, lambda number, stamp, pose: (
        stamp, (math.nan, *pose[1:]) if number == 100 else pose)), *SENSORS],
    'not_normalised': [*LOCALISER, *_numbered(WHEELS, lambda number, stamp, pose: (
        stamp, (*pose[:3], *(1.1 * value for value in pose[3:])))), *SENSORS],
    'unreadable': [*ROBOT, Message(BEGIN + ns(1.0), '/tf', [], data=b'\0\1\0\0\xff\xff')],
    'impossible_stamp': [*LOCALISER, *_with_impossible_stamps(WHEELS), *SENSORS],
    'kind_flips': [*ROBOT, *fixed(('odom', 'base_link', at(0.1)), begin=2.0)],
    'static_late': [*LOCALISER, *WHEELS, *fixed(('base_link', 'lidar', at(0.3)), begin=4.0)],
    'zero_stamps': [*LOCALISER, *WHEELS, *SENSORS,
                    *_numbered(send(('base_link', 'pan', swing)),
                               lambda number, stamp, pose: (0, pose))],
    'future_stamps': [*LOCALISER, *WHEELS, *SENSORS,
                      *send(('base_link', 'pan', swing), ('pan', 'tilt', swing),
                            stamp=lambda t: t + 0.4)],
    'post_dated': [*WHEELS, *ARM, *SENSORS,
                   *send(('map', 'odom', drift), rate_hz=20.0, stamp=lambda t: t + 0.2)],
    'clock_offset': [*LOCALISER, *WHEELS, *SENSORS,
                     *send(('base_link', 'pan', swing), stamp=lambda t: t - 0.25)],
    'clock_mixture': [*LOCALISER, *WHEELS, *SENSORS,
                      *simulated(send(('base_link', 'pan', swing)), 1.0)],
    'clock_step': [*LOCALISER, *WHEELS, *SENSORS, *send(
        ('base_link', 'pan', swing), stamp=lambda t: t + 0.72 * (t > 4.0))],
    'recorder_clock': [message._replace(received=message.received - ns(
        2.0 if message.received > BEGIN + ns(4.0) else 0.0)) for message in ROBOT],
    'clock_drift': [*LOCALISER, *WHEELS, *SENSORS, *send(
        ('base_link', 'pan', swing), stamp=lambda t: 0.95 * t)],
    'frozen_stamp': [*WHEELS, *ARM, *SENSORS, *send(
        ('map', 'odom', drift), rate_hz=20.0, stamp=lambda t: min(t, 1.5))],
    'whole_seconds': [*LOCALISER, *WHEELS, *SENSORS,
                      *send(('base_link', 'pan', swing), stamp=math.floor)],
    'lone_stamp': [*LOCALISER, *_numbered(WHEELS, lambda number, stamp, pose: (
        stamp - ns(31_536_000.0) if number == 100 else stamp, pose)), *SENSORS],
    'jump_back': _looped(),
    'duplicate_stamps': [*LOCALISER, *SENSORS,
                         *send(('odom', 'base_link', drive), rate_hz=100.0,
                               stamp=lambda t: math.floor(50.0 * t + 1e-6) / 50.0)],
    'out_of_order': [*LOCALISER, *SENSORS, *_numbered(WHEELS, lambda number, stamp, pose: (
        stamp - ns(0.05) if number % 10 == 5 else stamp, pose))],
    'stale': [*LOCALISER, *SENSORS, *send(('odom', 'base_link', drive), end=3.0)],
    'gap': [*LOCALISER, *SENSORS, *send(('odom', 'base_link', drive), end=3.0),
            *send(('odom', 'base_link', drive), begin=5.0)],
    'irregular_rate': [*send(('odom', 'base_link', drive), times=IRREGULAR), *SENSORS],
    'slow_for_window': [*send(('odom', 'base_link', drive), end=30.0), *SENSORS,
                        *send(('map', 'odom', drift), rate_hz=1.0 / 12.0, end=30.0)],
    'skew': [*send(('odom', 'base_link', drive), end=16.0), *SENSORS,
             *send(('map', 'odom', drift), rate_hz=0.5, end=16.0)],
    'pose_jump': [*LOCALISER, *SENSORS, *send(('odom', 'base_link', _jumping)),
                  *send(('base_link', 'arm', swing))],
    'moved_once': [*ROBOT, *send(('base_link', 'imu', lambda t: at(0.1 if t < 4.0 else 0.13)(t)),
                                 rate_hz=20.0)],
    'outlier': [*LOCALISER, *SENSORS, *_numbered(WHEELS, lambda number, stamp, pose: (
        stamp, STILL if number % 60 == 59 else pose)), *send(('base_link', 'arm', swing))],
    'too_fast': [*LOCALISER, *SENSORS, *send(('odom', 'base_link', lambda t: Pose(x=400.0 * t)))],
    'qos_mismatch': [*LOCALISER, *SENSORS, *send(('odom', 'base_link', drive),
                                                 qos=BEST_EFFORT)],
    **{code: [*ROBOT, *_diagnosed(switched(code, BufferCore()))] for code in SWITCHED},
}


def written(code, folder):
    """Write the bag of a fault; return its path."""
    return write_ros2(folder / code, sorted(FAULTY[code], key=lambda each: each.received))
