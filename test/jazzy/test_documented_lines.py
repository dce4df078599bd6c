# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Every line of the documentation that begins with ``ros2``, run with the real command."""

import os
from pathlib import Path
import re
import shlex

from programs import Program
import pytest
from test_ros2_verbs import VERBS

REPOSITORY = Path(__file__).parents[2]
PAGES = [REPOSITORY / 'README.md', *sorted(REPOSITORY.glob('docs/**/*.md'))]
# This description takes the place of the readers' own.
DESCRIPTION = REPOSITORY / 'config' / 'five_frames.urdf'
# The name of a node that shows that the program runs; None: its output shows it.
NODES = {
    'buffer_server': '/tf_buffer',
    'edge_switch': '/edge_switch',
    'five_frame_demo': None,
    'relocalisation_anchor': '/relocalisation_anchor',
    'tf_relay': '/robot1/tf_relay',
    'tf_share': '/tf_share',
    'urdf_broadcaster': '/urdf_broadcaster',
    'urdf_broadcaster.launch.py': '/urdf_broadcaster',
}
# Not tested here: playing a recording, RViz, the reader's own launch and xacro files, and a
# command that waits for the reader's topic.
# An installed Jazzy also has no eclipse-zenoh: test/nodes/test_relay_over_zenoh.py has it, and
# test_urdf_broadcaster.py has xacro. test/nodes/test_tf_share.py has tf_share --status.
OTHERS = re.compile('ros2 (bag play|launch your_package|run tf_tree_py NAME|topic hz /clock'
                    '|.* --(from-)?zenoh '
                    r'|.* rviz:=true|.*\.xacro|.*tf_share --status)')


def documented():
    """Return the lines, without those that only name a command."""
    found = {}
    for page in PAGES:
        text = page.read_text()
        lines = re.findall('(?m)^(ros2 .*)$', text) + re.findall('`(ros2 [^`]+)`', text)
        for words in (shlex.split(line, comments=True) for line in lines):
            found.setdefault(' '.join(words), words)
    return [words for line, words in found.items()
            if not OTHERS.match(line) and len(words) > 2]


LINES = documented()
STARTED = [words for words in LINES if words[1] in ('run', 'launch')]
ASKED = [words for words in LINES if words[1] not in ('run', 'launch')]


@pytest.mark.parametrize('words', STARTED, ids=' '.join)
def test_it_runs_until_ctrl_c(start, await_output, wait_until_gone, words):
    node = NODES[words[3]]
    if node:
        wait_until_gone(f'(?m)^{node}$', 'node', 'list')
    program = start(*(word.replace('arm.urdf', str(DESCRIPTION)) for word in words))
    if '--seconds' not in words:  # otherwise it ends by itself
        if node:
            await_output(f'(?m)^{node}$', 'node', 'list')
        else:
            program.wait_for('xyz')
        program.interrupt()
    assert program.end() == 0, program.output
    assert 'Traceback' not in program.output


@pytest.fixture
def recording(env, start, tmp_path):
    """Start tf_record in the Python of the tests, because an installed Jazzy has no rosbags."""
    pytest.importorskip('rosbags')
    start('ros2', 'run', 'tf_tree_py', 'five_frame_publisher')
    program = Program('tf_record', '-o', str(tmp_path), own_terminal=True,
                      env={**os.environ, 'ROS_DOMAIN_ID': env['ROS_DOMAIN_ID']})
    program.wait_for('keeping the last')
    yield program
    program.kill()


@pytest.fixture
def switching(start):
    """Start edge_switch without data from its sources."""
    return start('ros2', 'run', 'tf_tree_py', 'edge_switch', '--ros-args',
                 '-p', 'sources:=[wheel, vo]')


@pytest.fixture
def serving(start):
    """Start buffer_server without data."""
    return start('ros2', 'run', 'tf_tree_py', 'buffer_server')


@pytest.fixture
def simulated(start):
    """Start a node of simulated time with the name that stands for the reader's own."""
    return start('ros2', 'run', 'tf_tree_py', 'static_transform_publisher',
                 '--frame-id', 'map', '--child-frame-id', 'odom', '--ros-args',
                 '-r', '__node:=your_node', '-p', 'use_sim_time:=true')


# The program that a node, a service or an action needs, and the response.
ANSWERS = {
    '/tf_record/dump': ('recording', 'success=True'),
    '/edge_switch/switch_to/vo': ('switching', 'no source has been received yet'),
    '/tf2_buffer_server': ('serving', 'Goal finished with status: SUCCEEDED'),
    '/your_node': ('simulated', 'Boolean value is: True'),
    '/clock': ('simulated', '(?s)Publisher count: 0.*Node name: your_node.*SUBSCRIPTION'),
}


@pytest.mark.parametrize('words', ASKED, ids=' '.join)
def test_it_answers(request, output_of, await_output, words):
    if words[1] == 'tf':
        assert words[2] in VERBS  # test_ros2_verbs runs them
        return
    if words[2] == 'list':
        output_of(*words[1:])  # test_ros2_commands reads what it lists
        return
    running, answer = ANSWERS[words[3]]
    request.getfixturevalue(running)
    await_output(answer, *words[1:])
