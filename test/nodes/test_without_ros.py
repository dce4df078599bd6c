# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Installed executables, started by nodes/starting.py or tools/starting.py, without ROS."""

from importlib.metadata import distribution
import os
from pathlib import Path
import sys

from programs import completed
import pytest
import tf_tree_py

# They read recordings, or run another program.
NEVER_NEED_ROS = {'tf_archive', 'tf_audit', 'tf_export'}
EXECUTABLES = sorted({script.name for script in distribution('tf_tree_py').entry_points.select(
    group='console_scripts')} - NEVER_NEED_ROS)
ARGUMENTS = {'tf_lab': ['latency', '--ros'], 'tf_echo': ['map', 'base'],
             'tf_calibrate': ['--edge', 'base', 'camera', '--observations', '/target',
                              '--fixed-in', 'map']}

# Like the scripts that pip creates, with rclpy and the messages hidden.
SCRIPT = """
import sys
from importlib.metadata import distribution

class Blocker:
    def find_spec(self, name, path=None, target=None):
        top = name.split('.')[0]
        if top in ('rclpy', 'builtin_interfaces', 'rcl_interfaces') or top.endswith('_msgs'):
            raise ModuleNotFoundError(f'no {name} here', name=name)

sys.meta_path.insert(0, Blocker())
name, *arguments = sys.argv[1:]
script, = distribution('tf_tree_py').entry_points.select(group='console_scripts', name=name)
sys.argv = [name, *arguments]
sys.exit(script.load()())
"""


@pytest.mark.parametrize('name', EXECUTABLES)
def test_executable_says_in_one_line_that_there_is_no_ros(name, tmp_path):
    ended = completed(
        sys.executable, '-c', SCRIPT, name, *ARGUMENTS.get(name, []), cwd=tmp_path,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(
            [str(Path(tf_tree_py.__file__).parents[1]), os.environ.get('PYTHONPATH', '')])})
    assert ended.returncode == 2
    assert ended.stdout == ''
    line, = ended.stderr.splitlines()
    assert line.startswith(f'{name}: ')
    assert 'needs ROS 2, and ' in line and ' is not installed: source a ROS 2 inst' in line


def test_what_is_missing_inside_the_package_is_not_blamed_on_ros(monkeypatch):
    from tf_tree_py.nodes import starting
    monkeypatch.setitem(sys.modules, 'tf_tree_py.nodes.tf_relay', None)
    with pytest.raises(ModuleNotFoundError):
        starting.tf_relay()
