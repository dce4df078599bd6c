# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Selects the reader for a file: rosbags, or a scan for files that rosbags refuses."""

from collections.abc import Callable
from pathlib import Path

from .connections import Scan, Storage
from .mcap_scan import McapScan
from .plain_file import PlainFile
from .ros1_scan import Ros1Scan
from .rosbags_file import RosbagsFile, UNREADABLE
from .salvage import SalvagedFile
from .sqlite_scan import SqliteScan

_SCANS: dict[str, Callable[[Path], Scan]] = {
    '.mcap': McapScan, '.bag': Ros1Scan, '.db3': SqliteScan}


def open_file(path: Path) -> Storage:
    """
    Open one file.

    :raises Exception: one of ``UNREADABLE``.
    """
    file = PlainFile(path)
    scan = _SCANS[file.path.suffix]
    try:
        if file.fault is not None:
            raise file.fault
        if file.path.suffix == '.mcap':
            scanned = McapScan(file.path)
            scanned.check_sizes()
            scanned.check_profile()
        return RosbagsFile(file, scan)
    except UNREADABLE as error:
        try:
            return SalvagedFile(file, scan, error)
        except UNREADABLE:
            file.close()
            raise ValueError(file.reason(error)) from None
