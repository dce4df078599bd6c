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

"""The notebook from a bag to the camera's uncertainty runs as it is, without ROS."""

import os
from pathlib import Path
import re
import subprocess
import sys

from programs import PATIENCE_S
import pytest

NOTEBOOK = Path(__file__).parents[2] / 'examples' / 'notebook_uncertainty.py'
# Once with a bag of its own, and once, elsewhere, with that bag.
TWICE = """
import os, runpy, sys
sys.modules.update(dict.fromkeys(('rclpy', 'geometry_msgs', 'nav_msgs', 'std_msgs')))
notebook = sys.argv[1]
for sys.argv in [notebook], [notebook, '../uncertain_drive']:
    runpy.run_path(notebook)
    os.mkdir('again')
    os.chdir('again')
"""


def test_notebook_tells_and_draws_how_sure_the_camera_is(tmp_path):
    pytest.importorskip('matplotlib')
    done = subprocess.run(
        [sys.executable, '-c', TWICE, NOTEBOOK], cwd=tmp_path, text=True, check=False,
        env={**os.environ, 'MPLBACKEND': 'agg'}, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stdout
    # Along the wall amcl is 0.4 m unsure, by far more than the camera's mounting and the turn.
    assert re.search(r'least sure the camera may be 0\.8\d m off .*\n +map -> odom adds 9\d%\n'
                     r' +base_link -> camera adds \d%', done.stdout)
    assert re.search(r'odometry alone it may be 1\.\d+ m off', done.stdout)
    assert 'Warning' not in done.stdout
    first, second = (done.stdout[part] for part in (slice(len(done.stdout) // 2),
                                                    slice(len(done.stdout) // 2, None)))
    assert first == second
    for folder in tmp_path, tmp_path / 'again':
        assert (folder / 'camera_uncertainty.png').read_bytes().startswith(b'\x89PNG')
    assert not (tmp_path / 'again' / 'uncertain_drive').exists()
