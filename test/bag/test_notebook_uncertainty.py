"""The notebook from a bag to the camera's uncertainty runs as it is, without ROS."""

import os
from pathlib import Path
import re
import subprocess
import sys

import pytest

NOTEBOOK = Path(__file__).parents[2] / 'examples' / 'notebook_uncertainty.py'
WITHOUT_ROS = """
import runpy, sys
sys.modules.update(dict.fromkeys(('rclpy', 'geometry_msgs', 'nav_msgs', 'std_msgs')))
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0])
"""


def run(folder, *arguments):
    done = subprocess.run(
        [sys.executable, '-c', WITHOUT_ROS, NOTEBOOK, *arguments], cwd=folder, text=True,
        env={**os.environ, 'MPLBACKEND': 'agg'}, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, timeout=60, check=False)
    return done.returncode, done.stdout


def test_notebook_tells_and_draws_how_sure_the_camera_is(tmp_path):
    pytest.importorskip('matplotlib')
    status, output = run(tmp_path)
    assert status == 0, output
    picture = tmp_path / 'camera_uncertainty.png'
    assert picture.read_bytes().startswith(b'\x89PNG')
    # Along the wall amcl is 0.4 m unsure, by far more than the camera's mounting and the turn.
    assert re.search(r'least sure the camera may be 0\.8\d m off .*\n +map -> odom adds 9\d%\n'
                     r' +base_link -> camera adds \d%', output)
    assert re.search(r'odometry alone it may be 1\.\d+ m off', output)
    assert 'Warning' not in output
    picture.unlink()
    again = tmp_path / 'again'
    again.mkdir()
    assert run(again, tmp_path / 'uncertain_drive') == (0, output)
    assert [path.name for path in again.iterdir()] == [picture.name]
