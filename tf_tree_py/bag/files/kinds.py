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
