# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
An installed ROS 2 Jazzy, with the real tf2 and the ``ros2`` command, and this package built on it.

It is the sourced one, or one that scripts/test made as a substitute beside the wheels. Tests
start processes in it. Where there is none, they skip.
"""

from functools import cache
from importlib.util import find_spec
import os
from pathlib import Path
import shutil
import subprocess
import textwrap

from domains import JAZZY_PROFILES, PROFILES
from programs import completed, PATIENCE_S
import pytest

# Set by scripts/test: the file that a shell sources to enter the Jazzy that was made.
_ENTRANCE = 'TF_TREE_PY_INSTALLED'

_NEEDED = ('needs an installed ROS 2 Jazzy (the ros2 command and tf2_ros): source one, or let '
           'scripts/test make one, which takes TF_TREE_PY_JAZZY')


def standin_env() -> dict[str, str]:
    """
    Return the environment variables of a shell in which Jazzy and this package are sourced.

    Its executables are on its PATH. Its Python is ``python3``, which may differ from the one that
    runs the tests. Without an installed Jazzy, the test skips.
    """
    if _is_sourced():
        variables = dict(os.environ)
    elif _ENTRANCE in os.environ:
        variables = dict(_entered(os.environ[_ENTRANCE]))
        # The variables that tests have set since.
        variables.update((name, value) for name, value in os.environ.items()
                         if name in {'ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'})
        # It is Jazzy, even if the tests run on Kilted.
        variables[JAZZY_PROFILES] = str(PROFILES)
    else:
        pytest.skip(_NEEDED)
    # Import the built package even if the current folder contains its source.
    return {**variables, 'PYTHONSAFEPATH': '1', 'PYTHONUNBUFFERED': '1'}


def run_with_tf2(code: str, **variables: str) -> str:
    """Run a program where tf2 is installed; return its output."""
    done = completed('python3', '-c', textwrap.dedent(code), env={**standin_env(), **variables})
    assert done.returncode == 0, done.stderr
    return done.stdout


def _is_sourced() -> bool:
    return shutil.which('ros2') is not None and find_spec('tf2_ros') is not None


@cache
def _entered(entrance: str) -> dict[str, str]:
    if not Path(entrance).is_file():
        raise FileNotFoundError(f'{_ENTRANCE}={entrance}: there is no such file')
    done = subprocess.run(
        ['bash', '-c', '. "$1" >&2; env --null', 'bash', entrance],
        stdout=subprocess.PIPE, text=True, timeout=PATIENCE_S, check=True)
    return dict(line.split('=', 1) for line in done.stdout.split('\0') if line)
