# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A repair of the wheels of ROS 2 Jazzy: ``python -m tf_tree_py.interfaces.cmake_exports``.

Some of their CMake exports name folders of the machine that built them. Packages with messages
cannot be configured until these are replaced by the folders of this machine.
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
        # Write a new file, because the old one may be a hard link into an installer's cache.
        file.unlink()
        file.write_text(text, encoding='utf-8')


if __name__ == '__main__':
    repair(Path(sys.prefix))
