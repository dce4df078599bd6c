# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The demo's fleet drives as its motions define, and ends on a signal."""

import os
from pathlib import Path
import sys

from fleet_helpers import free_port, PATIENCE_S
from programs import Program
import pytest
from tf_tree_py.core.geometry import se3
from tf_tree_py.fleet import FleetListener
from tf_tree_py.nodes.five_frame_motion import FiveFrameMotion

PROGRAM = Path(__file__).parents[2] / 'examples' / 'simulated_fleet.py'


@pytest.fixture
def start():
    programs = []

    def start(*arguments):
        programs.append(Program(sys.executable, str(PROGRAM), *arguments,
                                env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}))
        return programs[-1]

    yield start
    for program in programs:
        program.kill()


def test_fleet_drives_and_ends(start):
    endpoint = f'tcp/127.0.0.1:{free_port()}'
    program = start('3', '--listen', endpoint)
    program.wait_for('3 robots are driving')
    with FleetListener(endpoint) as listener:
        buffer = listener.buffer
        for number in (1, 2, 3):
            buffer.lookup_within(PATIENCE_S, 'map', f'robot{number}/gripper')
        assert [robot.name for robot in listener.robots()] == ['robot1', 'robot2', 'robot3']
        # The third starts at the beginning of the second row.
        stamp = buffer.latest_common_time('robot3/odom', 'robot3/base_link')
        truth = FiveFrameMotion(lap_time=17_000_000_000).odom_T_base_link(stamp)
        there = buffer.lookup('robot3/odom', 'robot3/base_link', stamp)
        assert max(se3.distance(there, truth)) < 1e-6
        buffer.lookup('robot3/base_link', 'robot3/camera')
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_fleet_of_nobody_is_refused(start):
    program = start('0')
    assert program.end() == 2
    assert 'a fleet must have at least one robot' in program.output
