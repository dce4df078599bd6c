# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files that are written completely or not at all."""

from collections.abc import Iterable
from contextlib import suppress
import os
from pathlib import Path


def write_whole(path: Path, parts: Iterable[bytes | bytearray | memoryview]) -> None:
    """
    Write a temporary file next to a path, then move it there, replacing an existing file.

    :raises OSError: it cannot be written; an existing file is unchanged.
    """
    unfinished = path.with_name(f'.{path.name}.{os.getpid()}.unfinished')
    try:
        with unfinished.open('wb') as file:
            file.writelines(parts)
        unfinished.replace(path)
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
