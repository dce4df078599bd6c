# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Debian's python3-tf2, in the system's Python: ROS 1's C++ tf2 with its binding.

Run by ``debian.Debian``; it imports only the standard library and ROS 1.
"""

import os
import queue
import random
import threading
import time

from geometry_msgs.msg import TransformStamped
import rospy
import tf2_py

from .cpp import CppBuffer
from .remote import serve_exercises
from .. import motion
from ..exercise import poll_as_tf2_does
from ..timing import clock


class Ros1Buffer(CppBuffer):
    """``tf2_py.BufferCore`` of ROS 1."""

    def __init__(self) -> None:
        super().__init__(tf2_py)

    def duration(self, seconds: float) -> rospy.Duration:
        """Return a duration of rospy."""
        return rospy.Duration.from_sec(seconds)

    def message(self, edge: motion.Edge, stamp: int, pose: motion.Pose) -> TransformStamped:
        """Return a transform as a message."""
        message = TransformStamped()
        message.header.stamp = self.time(stamp)
        message.header.frame_id = edge.parent
        message.child_frame_id = edge.child
        t, q = message.transform.translation, message.transform.rotation
        t.x, t.y, t.z, q.x, q.y, q.z, q.w = pose
        return message

    def time(self, stamp: int) -> rospy.Time:
        """Return a time of rospy."""
        return rospy.Time(*divmod(stamp, 1_000_000_000))


def wait_often(count: int) -> list[float]:
    """Return the seconds from each of many insertions to the return of a blocked lookup."""
    robot = motion.chain(1)
    peer = Ros1Buffer()
    peer.reset(robot, 10.0)
    stamps: queue.SimpleQueue[int] = queue.SimpleQueue()
    returned: queue.SimpleQueue[float] = queue.SimpleQueue()

    def wait() -> None:
        for _ in range(count):
            poll_as_tf2_does(peer, robot.target, robot.source, peer.time(stamps.get()), 10.0)
            returned.put(clock())

    waiting = threading.Thread(target=wait)
    waiting.start()
    waits = []
    for number in range(count):
        stamp = motion.START + number * motion.PERIOD
        message = peer.message(robot.edges[0], stamp, motion.pose_at(robot.edges[0], stamp))
        stamps.put(stamp)
        time.sleep(random.uniform(0.005, 0.025))
        begin = clock()
        peer.insert(message)
        waits.append(returned.get() - begin)
    waiting.join()
    return waits


def hoard(samples: int) -> float:
    """Return the bytes of memory per sample, measured with this number of samples."""
    robot = motion.chain(10)
    peer = Ros1Buffer()
    peer.reset(robot, 1e6)
    before = _resident_bytes()
    each = samples // len(robot.edges)
    for edge in robot.edges:
        for number in range(each):
            peer.insert(peer.message(edge, motion.START + number * motion.PERIOD,
                                     motion.pose_at(edge, motion.START)))
    return (_resident_bytes() - before) / (each * len(robot.edges))


def _resident_bytes() -> int:
    with open('/proc/self/statm') as file:
        return int(file.read().split()[1]) * os.sysconf('SC_PAGESIZE')


if __name__ == '__main__':
    serve_exercises(Ros1Buffer, {'wait_often': wait_often, 'hoard': hoard})
