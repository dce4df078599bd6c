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

"""Which files a bag consists of: one file, or a folder with its splits. Nothing is read here."""

from collections.abc import Sequence
from pathlib import Path
import re
from typing import NamedTuple

from ..errors import BagError, no_such_file

SUFFIXES = ('.mcap', '.db3', '.bag')
"""Of files with messages: rosbag2's two kinds, and ROS 1's."""

PACKED = '.zstd'
"""Behind one of them: the whole file is compressed."""

INDEX = 'metadata.yaml'
"""Of a folder with a bag, as rosbag2 writes it."""


class BagFiles(NamedTuple):
    """
    The files of one bag.

    :ivar present: in the order of their numbers.
    :ivar missing: names that the folder's index has, and the folder has not.
    """

    present: Sequence[Path]
    missing: Sequence[str]


def files_of(path: Path) -> BagFiles:
    """
    Return the files of a bag.

    :param path: a file, or a folder as rosbag2 writes it; its index may be missing.
    :raises BagError: nothing is there, or nothing that is a bag.
    """
    if not path.exists():
        raise no_such_file(path)
    if not path.is_dir():
        if not _holds_messages(path):
            raise BagError(f'{path} is no bag: its name ends in none of {", ".join(SUFFIXES)}')
        return BagFiles([path], [])
    present = sorted((file for file in path.iterdir() if _holds_messages(file)), key=_number)
    if not present:
        raise BagError(f'{path} is no bag: the folder has no file {", ".join(SUFFIXES)}')
    there = {file.name for file in present}
    return BagFiles(present, [name for name in _indexed(path / INDEX) if name not in there])


def _holds_messages(path: Path) -> bool:
    return path.is_file() and names_messages(path.name)


def names_messages(name: str) -> bool:
    """Return whether a file of that name should hold messages."""
    return name.removesuffix(PACKED).endswith(SUFFIXES)


def _number(path: Path) -> tuple[list[int], str]:
    """Sort run_10 behind run_9."""
    return [int(digits) for digits in re.findall(r'\d+', path.name)[-1:]], path.name


def _indexed(index: Path) -> list[str]:
    """Return the names that the folder's index lists; none where it cannot be read."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        listed = YAML(typ='safe').load(index.read_text())
        return [Path(name).name for name
                in listed['rosbag2_bagfile_information']['relative_file_paths']]
    except (OSError, ValueError, KeyError, TypeError, YAMLError):
        return []
