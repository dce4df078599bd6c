# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Files that are written completely or not at all."""

from collections.abc import Iterable
from contextlib import suppress
from functools import partial
import os
from pathlib import Path
import secrets
import stat

# The system follows no more symbolic links than this.
_LINKS = 40
# So many bytes of a file's name are in that of its temporary file; the system allows 255.
_BEGIN = 64


def write_whole(path: Path, parts: Iterable[bytes | bytearray | memoryview]) -> None:
    """
    Write a temporary file next to a file, then move it there, replacing an existing file.

    A symbolic link stays, and the file that it leads to is replaced. The mode of an existing file
    stays, and its owner where the system allows it. A pipe or a device, such as ``/dev/stdout``,
    is written in place.

    Threads and processes may write one path at the same time: one of their files stays.

    :raises OSError: it cannot be written; an existing file is unchanged. Its ``filename`` is the
        path.
    """
    try:
        _write(path, parts)
    except OSError as error:
        if error.errno is None:  # not of the system, but of what makes the parts
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def _write(path: Path, parts: Iterable[bytes | bytearray | memoryview]) -> None:
    existing = _status(path)
    if existing is not None and not stat.S_ISREG(existing.st_mode) or _is_open_file(path):
        with path.open('ab') as file:  # what `>> log` has so far stays
            file.writelines(parts)
        return
    place = Path(os.path.realpath(path))
    # Nobody can guess the name and put a symbolic link there, which 'x' would not follow anyway.
    begin = os.fsdecode(os.fsencode(place.name)[:_BEGIN])
    unfinished = place.with_name(f'.{begin}.{secrets.token_hex(8)}.unfinished')
    # Nobody else may read a file with a mode of its own before it has that mode.
    private = partial(os.open, mode=0o600)
    with open(unfinished, 'xb', opener=None if existing is None else private) as file:
        try:
            file.writelines(parts)
            file.flush()
            if existing is not None:
                _keep_owner_and_mode(file.fileno(), existing)
            unfinished.replace(place)
        except BaseException:
            with suppress(OSError):
                unfinished.unlink()
            raise


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _is_open_file(path: Path) -> bool:
    """Return whether a path leads to an open file of a process, as /dev/stdout does."""
    for _ in range(_LINKS):
        path = Path(os.path.realpath(path.parent), path.name)
        if path.is_relative_to('/proc'):
            return True
        if not path.is_symlink():
            break
        path = path.parent / path.readlink()
    return False


def _keep_owner_and_mode(handle: int, existing: os.stat_result) -> None:
    for owner, group in ((-1, existing.st_gid), (existing.st_uid, -1)):
        with suppress(OSError):
            os.fchown(handle, owner, group)
    # Afterwards, because a change of the owner removes the set-user-ID bit.
    os.fchmod(handle, stat.S_IMODE(existing.st_mode))
