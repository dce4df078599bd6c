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

"""Every line of the documentation that begins with ``ros2``, by the real command."""

import os
from pathlib import Path
import re
import shlex

from programs import Program
import pytest
from test_ros2_verbs import VERBS

REPOSITORY = Path(__file__).parents[2]
PAGES = [REPOSITORY / 'README.md', *sorted(REPOSITORY.glob('docs/**/*.md'))]
# Readers have a robot, and a description of it; here it is this one.
DESCRIPTION = REPOSITORY / 'config' / 'five_frames.urdf'
# By which node it is seen that it runs; None: by what it prints.
NODES = {
    'buffer_server': '/tf_buffer',
    'edge_switch': '/edge_switch',
    'five_frame_demo': None,
    'tf_relay': '/robot1/tf_relay',
    'urdf_broadcaster': '/urdf_broadcaster',
    'urdf_broadcaster.launch.py': '/urdf_broadcaster',
}
# Not ours: no recording is played here, and the reader's own launch file is not there. And an
# installed Jazzy has no eclipse-zenoh; test/nodes/test_relay_over_zenoh.py has it.
OTHERS = re.compile('ros2 (bag play|launch your_package|run tf_tree_py NAME|.* --(from-)?zenoh )')


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
def test_it_runs_until_ctrl_c(start, tell_at_last, words):
    program = start(*(word.replace('arm.urdf', str(DESCRIPTION)) for word in words))
    if '--seconds' not in words:  # else it ends by itself
        if node := NODES[words[3]]:
            tell_at_last(f'(?m)^{node}$', 'node', 'list')
        else:
            program.wait_for('xyz')
        program.interrupt()
    assert program.end() == 0, program.output
    assert 'Traceback' not in program.output


@pytest.fixture
def recording(env, start, tmp_path):
    """Start tf_record in the Python of the tests, for an installed Jazzy has no rosbags."""
    pytest.importorskip('rosbags')
    start('ros2', 'run', 'tf_tree_py', 'five_frame_publisher')
    program = Program('tf_record', '-o', str(tmp_path), own_terminal=True,
                      env={**os.environ, 'ROS_DOMAIN_ID': env['ROS_DOMAIN_ID']})
    program.wait_for('keeping the last')
    yield program
    program.kill()


@pytest.fixture
def switching(start):
    """Start edge_switch, whose sources are silent."""
    return start('ros2', 'run', 'tf_tree_py', 'edge_switch', '--ros-args',
                 '-p', 'sources:=[wheel, vo]')


# What has to run for a service, and what the service answers.
SERVICES = {
    '/tf_record/dump': ('recording', 'success=True'),
    '/edge_switch/switch_to/vo': ('switching', 'nothing was heard yet'),
}


@pytest.mark.parametrize('words', ASKED, ids=' '.join)
def test_it_answers(request, tell_at_last, words):
    if words[1] == 'tf':
        assert words[2] in VERBS  # test_ros2_verbs runs them
        return
    if words[1] == 'service':
        running, answer = SERVICES[words[3]]
        request.getfixturevalue(running)
        tell_at_last(answer, *words[1:])
    else:
        tell_at_last('', *words[1:])
