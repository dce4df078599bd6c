# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The code of README, and the documented argument types, pass the type checkers of users."""

from importlib.util import find_spec
import json
import os
from pathlib import Path
import subprocess
import sys

from pages import blocks_of, program, REPOSITORY
from programs import PATIENCE_S
import pytest

USES = Path(__file__).with_name('typed_uses.py')
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


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """Return one folder for all tests: mypy caches its data about numpy there."""
    return tmp_path_factory.mktemp('reader')


@pytest.fixture
def readme(folder):
    """Return the Python code of README as one file."""
    file = folder / 'readme.py'
    file.write_text(program([block for block in blocks_of(REPOSITORY / 'README.md')
                             if block.language == 'python']))
    return file


def judged(folder, *command):
    """Run a type checker as a user with this package installed; return the completed process."""
    return subprocess.run(
        [sys.executable, '-m', *command], cwd=folder, capture_output=True, text=True,
        timeout=4 * PATIENCE_S, check=False, env={**os.environ, 'MYPYPATH': str(REPOSITORY)})


def mypy(folder, file):
    pytest.importorskip('mypy')
    (folder / 'mypy.ini').write_text(MYPY)
    return judged(folder, 'mypy', '--config-file', 'mypy.ini', str(file))


def pyright(folder, file):
    """Run Pyright with its default strictness."""
    pytest.importorskip('basedpyright')
    (folder / 'pyrightconfig.json').write_text(json.dumps({
        'include': [str(file)], 'extraPaths': [str(REPOSITORY)], 'pythonVersion': '3.12',
        'typeCheckingMode': 'standard', 'reportMissingModuleSource': False,
        'enableTypeIgnoreComments': True}))
    return judged(folder, 'basedpyright', '--pythonpath', sys.executable, '--level', 'error')


@pytest.mark.skipif(find_spec('rclpy') is None, reason='needs rclpy')
@pytest.mark.parametrize('checker', [mypy, pyright])
def test_readme_passes(checker, folder, readme):
    done = checker(folder, readme)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize('checker', [mypy, pyright])
def test_types_admit_what_the_docs_admit(checker, folder):
    done = checker(folder, USES)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize('checker', [mypy, pyright])
def test_mistake_is_found(checker, folder):
    file = folder / 'mistake.py'
    file.write_text('from tf_tree_py import BufferCore\n'
                    "BufferCore().lookup('map', 'base', 1.5)\n")
    done = checker(folder, file)
    assert done.returncode == 1 and 'mistake.py:2' in done.stdout, done.stdout + done.stderr
