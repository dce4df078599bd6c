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

"""
A defect of the wheels of ROS 2 Jazzy, mended: ``python -m tf_tree_py.interfaces.cmake_exports``.

Some of their CMake exports name folders of the machine that built them, and no package with
messages is configured until these are the folders of this one.
"""

from collections.abc import Mapping
from pathlib import Path
import re
import sys
import sysconfig

import numpy as np


def repair(prefix: Path) -> None:
    """
    Write this Python's folders into the CMake exports of an environment.

    :param prefix: the folder of the environment.
    """
    folders = {
        r'/opt/python/[^;"]*/include/python3\.12': sysconfig.get_paths()['include'],
        r'/opt/python/[^;"]*/numpy/[^;"]*': np.get_include(),
    }
    for export in prefix.glob('share/**/*Export.cmake'):
        _replace(export, folders)


def _replace(file: Path, folders: Mapping[str, str]) -> None:
    text = before = file.read_text(encoding='utf-8')
    for pattern, folder in folders.items():
        text = re.sub(pattern, lambda _, folder=folder: folder, text)  # type: ignore[misc]
    if text != before:
        # A new file: the old one may be linked to that of an installer's cache.
        file.unlink()
        file.write_text(text, encoding='utf-8')


if __name__ == '__main__':
    repair(Path(sys.prefix))
