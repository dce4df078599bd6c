# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Program: look up the same in tf2's buffer and in ours, which receive one stream; print JSON."""

import itertools
import json
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time
import tf2_ros
import tf_tree_py
from tf_tree_py.nodes.five_frame_motion import Frames

PATIENCE_S = 30.0
CHAIN = list(Frames())
FRAMES = [*CHAIN, 'palm', 'nowhere', '']


def answer(buffer, method, *arguments):
    """Return seven numbers, or the names of the classes of the exception."""
    try:
        found = getattr(buffer, method)(*arguments)
    except Exception as error:  # noqa: B902 - the exceptions are compared
        return [cls.__name__ for cls in type(error).__mro__]
    if isinstance(found, Time):
        return [found.nanoseconds]
    at = found.transform.translation
    turn = found.transform.rotation
    stamp = found.header.stamp
    return [stamp.sec, stamp.nanosec, at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]


def newest(buffer):
    """Return the newest stamp of every edge of the robot."""
    return [answer(buffer, 'get_latest_common_time', *edge) for edge in itertools.pairwise(CHAIN)]


def has_all(buffer):
    return (all(len(stamp) == 1 for stamp in newest(buffer))
            and buffer.can_transform('island', 'palm', Time()))


def questions(stamp):
    """Yield lookups of many pairs, inside and outside the span, of both kinds."""
    pairs = list(itertools.product(FRAMES, FRAMES))
    for ago in (0.0, 0.013, 0.2, 0.51, 1.0, -0.4, 60.0):
        time = Time(nanoseconds=stamp - round(ago * 1e9))
        for target, source in pairs:
            yield 'lookup_transform', target, source, time
    for target, source in pairs:
        yield 'lookup_transform', target, source, Time()
        yield 'get_latest_common_time', target, source
        yield ('lookup_transform_full', target, Time(nanoseconds=stamp - 100_000_000), source,
               Time(nanoseconds=stamp - 700_000_000), 'world')


def main():
    rclpy.init()
    theirs_node, ours_node = rclpy.create_node('theirs'), rclpy.create_node('ours')
    theirs, ours = tf2_ros.Buffer(), tf_tree_py.Buffer()
    tf2_ros.TransformListener(theirs, theirs_node)
    listener = tf_tree_py.TransformListener(ours, ours_node)
    executor = SingleThreadedExecutor()
    executor.add_node(theirs_node)
    end = time.monotonic() + PATIENCE_S
    # After two seconds of the robot it is stopped; then both must have received the same.
    begun = None
    while begun is None or newest(ours)[-1][0] < begun + 2_000_000_000:
        executor.spin_once(timeout_sec=0.1)
        if begun is None and all(has_all(buffer) for buffer in (theirs, ours)):
            begun = max(stamp[0] for stamp in newest(theirs) + newest(ours))
        if time.monotonic() > end:
            sys.exit('no transform was received')
    print('heard', flush=True)
    sys.stdin.readline()
    while ours_node.count_publishers('/tf') or newest(theirs) != newest(ours):
        executor.spin_once(timeout_sec=0.1)
        if time.monotonic() > end:
            sys.exit('the two buffers did not receive the same transforms')
    stamp = newest(ours)[-1][0]
    print(json.dumps([
        {'question': [str(word) for word in question], 'theirs': answer(theirs, *question),
         'ours': answer(ours, *question)} for question in questions(stamp)]), flush=True)
    listener.close()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
