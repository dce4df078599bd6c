"""Which reader opens a file: rosbags, or a scan of what it refuses."""

from pathlib import Path

from .mcap_scan import McapScan
from .ros1_scan import Ros1Scan
from .rosbags_file import RosbagsFile, UNREADABLE
from .salvage import SalvagedFile, Scan
from .source import Storage
from .sqlite_scan import SqliteScan

_SCANS: dict[str, type[Scan]] = {'.mcap': McapScan, '.bag': Ros1Scan, '.db3': SqliteScan}

__all__ = ['open_file', 'UNREADABLE']


def open_file(path: Path) -> Storage:
    """
    Open one file.

    :raises Exception: one of ``UNREADABLE``.
    """
    try:
        return RosbagsFile(path)
    except UNREADABLE as error:
        if path.suffix not in _SCANS:
            raise
        try:
            return SalvagedFile(path, _SCANS[path.suffix], error)
        except UNREADABLE:
            raise error from None
