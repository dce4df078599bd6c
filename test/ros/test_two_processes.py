# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A publisher in another process: shared memory, discovery, and its death."""

from programs import executable, Program
from ros_helpers import LATEST, PATIENCE, until


def test_transforms_cross_the_border_of_processes(node, make_node, listen):
    early = listen(node)
    robot = Program(*executable('five_frame_publisher', '--ros-args', '-r', '__ns:=/far'))
    try:
        early.lookup_transform('base_link', 'camera', LATEST, PATIENCE)
        # DDS may announce a participant's nodes after its publishers have been matched.
        assert '_UNKNOWN_' not in early.all_frames_as_yaml()
        late = listen(make_node('late'))
        for buffer in (early, late):
            buffer.lookup_transform('world', 'camera', LATEST, PATIENCE)
            until(lambda buffer=buffer: {edge.authority for edge in buffer.edges()} == {
                '/far/five_frame_publisher'})
    finally:
        robot.interrupt()
        assert robot.end() == 0
    until(lambda: not node.count_publishers('/tf'))
    for buffer in (early, late):
        assert buffer.can_transform('world', 'camera', LATEST), 'its frames outlive it'
