# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A publisher in another process: shared memory, discovery, and its death."""

import subprocess
import sys
import textwrap

from ros_helpers import at, LATEST, PATIENCE, PATIENCE_S, until

PROGRAM = """
    import sys

    import rclpy
    from tf_tree_py import Pose, StaticTransformBroadcaster, TransformBroadcaster
    from tf_tree_py.ros.messages.convert import transform_stamped

    rclpy.init()
    node = rclpy.create_node('robot', namespace='/far')
    fixed, moving = StaticTransformBroadcaster(node), TransformBroadcaster(node)
    fixed.sendTransform(transform_stamped('base', 'camera', 0, Pose()))
    # Each line asks for one message at that time; the end of the input is the end.
    for line in sys.stdin:
        moving.sendTransform([transform_stamped('map', 'base', int(line) * 10**9, Pose())])
    rclpy.shutdown()
"""


def test_transforms_cross_the_border_of_processes(node, make_node, listen):
    early = listen(node)
    with subprocess.Popen([sys.executable, '-c', textwrap.dedent(PROGRAM)], text=True,
                          stdin=subprocess.PIPE) as robot:
        early.lookup_transform('base', 'camera', LATEST, PATIENCE)
        # DDS may announce a participant's nodes after its publishers have been matched.
        assert '_UNKNOWN_' not in early.all_frames_as_yaml()
        late = listen(make_node('late'))
        late.lookup_transform('base', 'camera', LATEST, PATIENCE)

        def moved():
            print(7, file=robot.stdin, flush=True)
            return all(buffer.can_transform('map', 'camera', at(7.0)) for buffer in (early, late))

        # Static and moving publishers of one process are not discovered at the same moment.
        until(moved)
        for buffer in (early, late):
            until(lambda buffer=buffer: {edge.authority for edge in buffer.edges()} == {
                '/far/robot'})
        robot.stdin.close()
        assert robot.wait(PATIENCE_S) == 0
    until(lambda: not node.count_publishers('/tf'))
    for buffer in (early, late):
        assert buffer.can_transform('map', 'camera', at(7.0)), 'its frames outlive it'
