"""Which reader opens a file: rosbags, or a scan of what it refuses."""

from collections.abc import Callable
from pathlib import Path

from .finding import PACKED
from .mcap_scan import McapScan
from .ros1_scan import Ros1Scan
from .rosbags_file import RosbagsFile, UNREADABLE
from .salvage import SalvagedFile
from .source import Scan, Storage
from .sqlite_scan import SqliteScan

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
        return RosbagsFile(path, scan)
    except UNREADABLE as error:
        try:
            return SalvagedFile(path, scan, error)
        except UNREADABLE:
            raise error from None
