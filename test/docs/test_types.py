# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The code of README, and the documented argument types, pass the type checkers of users."""

from importlib.util import find_spec
import json
import os
from pathlib import Path
import re
import shutil
import sys

from code_blocks import blocks_of, program, REPOSITORY
from programs import completed, PATIENCE_S
import pytest

USES = Path(__file__).with_name('typed_uses.py')
USES_OF_ROS = Path(__file__).with_name('typed_uses_of_ros.py')
MISTAKES = """
from typing import Literal
from tf_tree_py import BufferCore, FramedPose
buffer = BufferCore()
buffer.lookup('map', 'base', 1.5)  # wrong
buffer.lookup('map', 'base', max_age=0.5)  # wrong
map_T_base: FramedPose[Literal['map'], Literal['base']] = buffer.lookup_framed('map', 'base')
base_T_camera: FramedPose[Literal['base'], Literal['camera']] = (
    buffer.lookup_framed('base', 'camera'))
map_T_camera: FramedPose[Literal['map'], Literal['camera']]
map_T_camera = map_T_base @ base_T_camera
map_T_camera = (base_T_camera.inverse() @ map_T_base.inverse()).inverse()
map_T_camera = base_T_camera @ map_T_base  # wrong
map_T_camera = map_T_base.inverse() @ base_T_camera  # wrong
map_T_camera = map_T_base @ map_T_camera  # wrong
"""
# A user's configuration. Some methods of rclpy's nodes have no types, and messages have none.
MYPY = """
[mypy]
strict = True
follow_imports = silent
python_version = 3.12
disallow_untyped_calls = False

[mypy-sensor_msgs.*]
ignore_missing_imports = True
"""
PYRIGHT = json.dumps({
    'extraPaths': [str(REPOSITORY)], 'pythonVersion': '3.12', 'typeCheckingMode': 'standard',
    'reportMissingModuleSource': False, 'enableTypeIgnoreComments': True})

# How a user runs each type checker, Pyright with its default strictness.
CHECKERS = {
    'mypy': ['mypy', '--config-file', 'mypy.ini', '.'],
    'basedpyright': ['basedpyright', '--pythonpath', sys.executable, '--level', 'error'],
}

_ERROR = re.compile(r'(\w+)\.py:(\d+).* error: ')


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return a user's folder with the code of README, the documented uses, and mistakes."""
    folder = tmp_path_factory.mktemp('reader')
    (folder / 'mypy.ini').write_text(MYPY)
    (folder / 'pyrightconfig.json').write_text(PYRIGHT)
    (folder / 'mistakes.py').write_text(MISTAKES)
    shutil.copy(USES, folder)
    if find_spec('rclpy'):
        shutil.copy(USES_OF_ROS, folder)
        (folder / 'readme.py').write_text(program([
            block for block in blocks_of(REPOSITORY / 'README.md') if block.language == 'python']))
    return folder


@pytest.fixture(scope='module', params=CHECKERS)
def errors(request, folder):
    """Run a type checker as a user with this package installed; return its errors by file."""
    pytest.importorskip(request.param)
    done = completed(sys.executable, '-m', *CHECKERS[request.param], cwd=folder,
                     timeout=4 * PATIENCE_S, env={**os.environ, 'MYPYPATH': str(REPOSITORY)})
    assert done.returncode == 1, done.stdout + done.stderr
    errors = {file.stem: {} for file in folder.glob('*.py')}
    for line in done.stdout.splitlines():
        if found := _ERROR.search(line):
            errors[found[1]].setdefault(int(found[2]), line)
    return errors


@pytest.mark.skipif(find_spec('rclpy') is None, reason='needs rclpy')
def test_readme_and_the_documented_uses_of_ros_pass(errors):
    assert (errors['readme'], errors['typed_uses_of_ros']) == ({}, {})


def test_types_admit_what_the_docs_admit(errors):
    assert errors['typed_uses'] == {}


def test_mistakes_are_found(errors):
    wrong = {number for number, line in enumerate(MISTAKES.splitlines(), 1)
             if line.endswith('# wrong')}
    assert errors['mistakes'].keys() == wrong, errors
