# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The anchor over DDS: the unchanged node, a robot, and a late relocaliser.

The robot drives in real time, so for seconds instead of minutes.
"""

from contextlib import AbstractContextManager
from multiprocessing.connection import Connection
import time

from geometry_msgs.msg import PoseWithCovarianceStamped
import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from tf_tree_py.core.geometry import se3
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.messages.wire import write
from tf_tree_py.core.stamp import as_seconds, from_seconds
from tf_tree_py.ros.messages.pose_covariances import pose_with_covariance_stamped
from tf_tree_py.ros.topics.qos import dynamic_qos, TF_TOPIC

from .live_session import answer, executable, listening, PATIENCE_S, session, ticks
from ..anchor import COVARIANCE, driven, LATE_S, LIMITS, measured, odometry, Pass, sightings, STEP
from ..report import Column, Report, Table

_SECONDS = 12.0
_SETTLED_S = 3.0
_NAME = 'relocalisation_anchor'


def robot(node: Node, pipe: Connection, seconds: float) -> None:
    """Publish odometry at 50 Hz, and each pose 300 ms late; send the time of the start."""
    tf = node.create_publisher(TFMessage, TF_TOPIC, dynamic_qos())
    poses = node.create_publisher(PoseWithCovarianceStamped, 'pose', 10)
    for _ in ticks(pipe, STEP):
        if poses.get_subscription_count() and tf.get_subscription_count() >= 2:
            break
    odom_T_base, seen = odometry(seconds), list(sightings(seconds))
    began = time.time_ns()
    pipe.send(began)
    for _ in ticks(pipe, STEP):
        passed = time.time_ns() - began
        number = passed // STEP
        if number >= len(odom_T_base):
            break
        tf.publish(write([Sample('odom', 'base_link', began + number * STEP,
                                 odom_T_base[number])]))
        while seen and seen[0][0] + from_seconds(LATE_S) <= passed:
            stamp, pose = seen.pop(0)
            poses.publish(pose_with_covariance_stamped('map', began + stamp, pose, COVARIANCE))
    pipe.send(None)
    pipe.recv()


def anchor() -> AbstractContextManager[None]:
    """Run the node with the lab's limits."""
    return executable(
        _NAME, '--ros-args', '-p', f'over:={as_seconds(LIMITS.over)}',
        '-p', f'max_speed:={LIMITS.max_speed}', '-p', f'max_turn_rate:={LIMITS.max_turn_rate}',
        '-p', 'rate_hz:=100.0')


def run(seconds: float = _SECONDS) -> Report:
    """Let the robot drive in real time, and record its published poses."""
    with session() as lab, anchor():
        kept = Duration(seconds=seconds + 60.0)
        with listening(lab.node('planner'), cache_time=kept) as buffer:
            pipe = lab.start(robot, seconds)
            began = answer(pipe)
            while answer(pipe) is not None:
                pass
            stamps = np.arange(from_seconds(_SETTLED_S), from_seconds(seconds - 0.5), STEP)
            # The node may be later than the robot.
            buffer.lookup_within(PATIENCE_S, 'map', 'base_link', began + int(stamps[-1]))
        odom_T_base, map_T_base = (
            np.asarray(buffer.lookup_many(frame, 'base_link', began + stamps))
            for frame in ('odom', 'map'))
    alone = se3.compose_many(np.array(driven(0)), odom_T_base)
    return _report(measured('no anchor', stamps, alone), measured(_NAME, stamps, map_T_base))


def _report(alone: Pass, ours: Pass) -> Report:
    rate = LIMITS.max_speed * as_seconds(STEP)
    return Report(
        tables=[Table(
            f'The node over DDS, poses that arrive {LATE_S * 1e3:.0f} ms late',
            (Column('name', 'map -> odom'), Column('median_m', 'off, median [cm]', '.1f'),
             Column('worst_m', 'worst [cm]', '.1f'),
             Column('step_m', 'largest step in 20 ms [cm]', '.1f')),
            [(one.name, float(np.median(one.errors)), float(one.errors.max()),
              float(one.steps.max())) for one in (alone, ours)])],
        law=f'the pose of the robot in every tf2 listener is {100 * np.median(ours.errors):.1f} '
            f'cm off, and no step of 20 ms exceeds its own motion, '
            f'{100 * alone.steps.max():.1f} cm, plus the stated rate, {100 * rate:.1f} cm.',
        remarks=['In real time this is too short for outliers and much drift: tf_lab anchor '
                 'without --ros simulates minutes of both.'],
        numbers={'anchored_m': float(np.median(ours.errors)), 'rate_m': rate,
                 'own_step_m': float(alone.steps.max()), 'step_m': float(ours.steps.max())})
