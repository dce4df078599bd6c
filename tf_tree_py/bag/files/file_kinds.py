# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Selects the reader for a file: rosbags, or a scan for files that rosbags refuses."""

from collections.abc import Callable
from pathlib import Path

from .discovery import PACKED
from .mcap_scan import McapScan
from .message_source import Scan, Storage
from .ros1_scan import Ros1Scan
from .rosbags_file import RosbagsFile, UNREADABLE
from .salvage import SalvagedFile, SqliteScan

_SCANS: dict[str, Callable[[Path], Scan]] = {
    '.mcap': McapScan, '.bag': Ros1Scan, '.db3': SqliteScan}

__all__ = ['open_file', 'UNREADABLE']


def open_file(path: Path) -> Storage:
    """
    Open one file.

    :raises Exception: one of ``UNREADABLE``.
    """
    kind = path.name.removesuffix(PACKED).rpartition('.')[2]
    scan = _SCANS[f'.{kind}']
    try:
        if kind == 'mcap' and path.suffix != PACKED:
            McapScan(path).check_sizes()
        return RosbagsFile(path, scan)
    except UNREADABLE as error:
        try:
            return SalvagedFile(path, scan, error)
        except UNREADABLE:
            raise error from None
