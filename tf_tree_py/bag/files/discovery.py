# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Finds the files of a bag: one file, or a folder with its splits. It reads no messages."""

from collections.abc import Sequence
from pathlib import Path
import re
from typing import NamedTuple

from tf_tree_py.recording.errors import BagError

SUFFIXES = ('.mcap', '.db3', '.bag')
"""The suffixes of files with messages: rosbag2's two kinds, and ROS 1's."""

PACKED = ('.zstd', '.zst')
"""
Additional suffixes after one of them, of rosbag2 and of the ``zstd`` command.

The whole file is compressed.
"""

LOG = '-wal'
"""SQLite appends this to a file's name for its write-ahead log, which has the newest rows."""

INDEX = 'metadata.yaml'
"""The name of the index of a bag's folder, as rosbag2 writes it."""


class BagFiles(NamedTuple):
    """
    The files of one bag.

    :ivar present: in the order of their numbers.
    :ivar missing: names of files that do not exist, though the folder's index or a log of SQLite
        names them.
    """

    present: Sequence[Path]
    missing: Sequence[str]


def files_of(path: Path) -> BagFiles:
    """
    Return the files of a bag.

    :param path: a file, or a folder as rosbag2 writes it; its index may be missing.
    :raises BagError: the path does not exist, or is not a bag.
    """
    if not path.exists():
        raise BagError(f'{path}: there is no such file or folder')
    if not path.is_dir():
        if not _holds_messages(path):
            raise BagError(f'{path} is not a bag: its name ends in none of {", ".join(SUFFIXES)}')
        return BagFiles([path], [])
    present = sorted((file for file in path.iterdir() if _holds_messages(file)), key=_number)
    left = [file.name.removesuffix(LOG) for file in sorted(path.glob(f'*.db3{LOG}'))]
    if not present:
        only = f', only {left[0]}{LOG}, the log of one that is missing' if left else ''
        raise BagError(f'{path} is not a bag: the folder has no file {", ".join(SUFFIXES)}{only}')
    there = {file.name for file in present}
    named = dict.fromkeys([*_indexed(path / INDEX), *left])
    return BagFiles(present, [name for name in named if name not in there])


def _holds_messages(path: Path) -> bool:
    return path.is_file() and names_messages(path.name)


def names_messages(name: str) -> bool:
    """Return whether a file with this name should hold messages."""
    stem, dot, last = name.rpartition('.')
    return (stem if dot + last in PACKED else name).endswith(SUFFIXES)


def _number(path: Path) -> tuple[list[int], str]:
    """Return a sort key that puts run_10 after run_9."""
    return [int(digits) for digits in re.findall(r'\d+', path.name)[-1:]], path.name


def _indexed(index: Path) -> list[str]:
    """Return the names that the folder's index lists; none if it cannot be read."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        listed = YAML(typ='safe').load(index.read_text())
        return [Path(name).name for name
                in listed['rosbag2_bagfile_information']['relative_file_paths']]
    except (OSError, ValueError, KeyError, TypeError, YAMLError):
        return []
