# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""A program: tf2's buffer and ours hear one stream, and are asked the same. It prints JSON."""

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
    """Return seven numbers, or the names of the classes of what was raised."""
    try:
        found = getattr(buffer, method)(*arguments)
    except Exception as error:  # noqa: B902 - that is what is compared
        return [kind.__name__ for kind in type(error).__mro__]
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
    """Yield questions about many pairs, in the span and outside, of both kinds of lookup."""
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
    # Two seconds of the robot; then it is told to stop, and both have to have heard the same.
    begun = None
    while begun is None or newest(ours)[-1][0] < begun + 2_000_000_000:
        executor.spin_once(timeout_sec=0.1)
        if begun is None and all(has_all(buffer) for buffer in (theirs, ours)):
            begun = max(stamp[0] for stamp in newest(theirs) + newest(ours))
        if time.monotonic() > end:
            sys.exit('nothing was heard')
    print('heard', flush=True)
    sys.stdin.readline()
    while ours_node.count_publishers('/tf') or newest(theirs) != newest(ours):
        executor.spin_once(timeout_sec=0.1)
        if time.monotonic() > end:
            sys.exit('the two did not hear the same')
    stamp = newest(ours)[-1][0]
    print(json.dumps([
        {'question': [str(word) for word in question], 'theirs': answer(theirs, *question),
         'ours': answer(ours, *question)} for question in questions(stamp)]), flush=True)
    listener.close()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
