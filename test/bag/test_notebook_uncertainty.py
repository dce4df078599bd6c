# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The notebook about the camera's uncertainty from a bag runs unchanged, without ROS."""

import os
from pathlib import Path
import re
import subprocess
import sys

from programs import PATIENCE_S
import pytest

NOTEBOOK = Path(__file__).parents[2] / 'examples' / 'notebook_uncertainty.py'
# Once with a bag that it writes, and once, in another folder, with that bag.
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
    # Along the wall, amcl has an error of 0.4 m, far more than those of the mounting and the turn.
    assert re.search(r'least certain, the error .* is up to 0\.8\d m .*\n +map -> odom adds 9\d%\n'
                     r' +base_link -> camera adds \d%', done.stdout)
    assert re.search(r'odometry alone, the error at the end is up to 1\.\d+ m ', done.stdout)
    assert 'Warning' not in done.stdout
    first, second = (done.stdout[part] for part in (slice(len(done.stdout) // 2),
                                                    slice(len(done.stdout) // 2, None)))
    assert first == second
    for folder in tmp_path, tmp_path / 'again':
        assert (folder / 'camera_uncertainty.png').read_bytes().startswith(b'\x89PNG')
    assert not (tmp_path / 'again' / 'uncertain_drive').exists()
