# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A publisher in another process: discovery, shared memory, and its death."""

from pathlib import Path
import re
import sys

from domains import with_shared_memory
from programs import executable, PATIENCE_S, Program
import pytest
from rclpy.utilities import get_rmw_implementation_identifier
from ros_helpers import LATEST, PATIENCE, transform, until

# On Linux, a list of the files that a process has mapped into its memory. Fast DDS has one for
# each of its receivers.
MAPS = Path('/proc/self/maps')
RECEIVERS = re.compile('/dev/shm/fast(rtps|dds)_port')


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


def test_programs_reach_each_other_through_shared_memory():
    """As by default; all other tests use the loopback interface only."""
    env = with_shared_memory()
    robot = Program(*executable('five_frame_publisher'), env=env)
    echo = Program(sys.executable, '-m', 'tf_tree_py.tools.tf_echo', 'world', 'gripper', '--once',
                   '--seconds', str(PATIENCE_S / 2), env=env)
    try:
        assert echo.end() == 0, echo.output
        if MAPS.exists() and 'fastrtps' in get_rmw_implementation_identifier():
            assert RECEIVERS.search(Path(f'/proc/{robot.pid}/maps').read_text())
    finally:
        echo.kill()
        robot.interrupt()
        assert robot.end() == 0
    assert ' xyz ' in echo.output


@pytest.mark.skipif(not MAPS.exists(), reason='only Linux lists the memory of a process in a file')
def test_process_of_tests_receives_nothing_through_shared_memory(talker, node, listen):
    buffer = listen(node)
    talker.move(transform('map', 'base', 1.0))
    buffer.lookup_transform('map', 'base', LATEST, PATIENCE)
    assert not RECEIVERS.search(MAPS.read_text())
