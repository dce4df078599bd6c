# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Where shared trees are, and who writes them.

Each user has a folder of their own in ``/dev/shm``, and each tree two files there: its memory, and
a lock that its writer holds as long as it lives. The system releases the lock with the process, so
whether somebody writes is certain; nothing is inferred from the files.
"""

from collections.abc import Sequence
import errno
import fcntl
import hashlib
import os
from pathlib import Path
import stat
import struct
from typing import NamedTuple

from .errors import SharedTreeException
from .layout import check_platform

TOPICS = ('/tf', '/tf_static')

SHARED_MEMORY = Path('/dev/shm')
# struct flock: type, whence, start, length (0: the whole file), pid (0 for these locks).
_flock = struct.Struct('hhqqi4x')
_PRIVATE = 0o700


def folder() -> Path:
    """
    Return the folder of this user's trees, which need not exist.

    :raises SharedTreeException: trees cannot be shared on this machine.
    """
    check_platform()
    return SHARED_MEMORY / f'tf_tree_py-{os.geteuid()}'


def other_users() -> list[str]:
    """Return the numbers of other users who have a folder."""
    return sorted(path.name.rpartition('-')[2] for path in SHARED_MEMORY.glob('tf_tree_py-*')
                  if path != folder())


class Place:
    """
    The place of one tree.

    :ivar memory: the file with the tree.
    :ivar lock: the file that its writer locks.
    :ivar what: for texts, such as ``/tf and /tf_static of domain 0``.
    """

    def __init__(self, domain_id: int | None = None, topics: Sequence[str] = TOPICS, *,
                 name: str = '') -> None:
        """
        Name the place, without looking at it.

        :param domain_id: of ROS; None: that of the environment, or 0.
        :param topics: the resolved names of the topics that the tree is received from.
        :param name: that of its files; '': the one that follows from the others.
        """
        self.what = name
        if not name:
            name = self._name(domain_id, topics)
        self.memory = folder() / f'{name}.tree'
        self.lock = folder() / f'{name}.lock'

    def _name(self, domain_id: int | None, topics: Sequence[str]) -> str:
        if domain_id is None:
            given = os.environ.get('ROS_DOMAIN_ID') or '0'
            if not given.isdecimal():
                raise SharedTreeException(f'ROS_DOMAIN_ID is not a number: {given!r}')
            domain_id = int(given)
        name = f'domain-{domain_id}'
        if tuple(topics) != TOPICS:
            name += f'-{hashlib.sha256(" ".join(topics).encode()).hexdigest()[:16]}'
        self.what = f'{" and ".join(topics)} of domain {domain_id}'
        return name

    def make_folder(self) -> None:
        """
        Make the folder if it does not exist.

        :raises SharedTreeException: another user can write there.
        """
        try:
            self.memory.parent.mkdir(mode=_PRIVATE, exist_ok=True)
        except OSError as error:
            raise SharedTreeException(
                f'{self.memory.parent} cannot be made: {error.strerror}') from error
        self.check_folder()

    def check_folder(self) -> None:
        """
        Check that only this user could have put something into the folder, if it exists.

        :raises SharedTreeException: another user can write there.
        """
        where = self.memory.parent
        try:
            status = where.lstat()
        except FileNotFoundError:
            return
        if (not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid()
                or status.st_mode & 0o022):
            raise SharedTreeException(
                f'{where} is not a folder that only this user can write to: it belongs to the '
                f'user {status.st_uid}, with the mode {status.st_mode & 0o777:o}. Remove it')


def opened(path: Path, flags: int, mode: int = 0o600) -> int:
    """
    Open a file of a place; no symbolic link is followed, and no child process inherits it.

    :raises FileNotFoundError: it does not exist.
    :raises SharedTreeException: it cannot be opened.
    """
    try:
        return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC, mode)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise SharedTreeException(f'{path} cannot be opened: {error.strerror}') from error


def hold(place: Place) -> int:
    """
    Become the writer of a place.

    :return: a file descriptor; it is the writer's until it is closed.
    :raises SharedTreeException: another process is the writer.
    """
    try:
        descriptor = opened(place.lock, os.O_RDWR | os.O_CREAT)
    except FileNotFoundError:
        raise SharedTreeException(f'{place.lock.parent} has just been removed') from None
    try:
        fcntl.fcntl(descriptor, fcntl.F_OFD_SETLK, _flock.pack(fcntl.F_WRLCK, 0, 0, 0, 0))
        # As long as that of the writer before, so that the file always has a number.
        os.pwrite(descriptor, b'%10d\n' % os.getpid(), 0)
    except OSError as error:
        holder = os.pread(descriptor, 32, 0).decode(errors='replace').strip()
        os.close(descriptor)
        if error.errno not in (errno.EAGAIN, errno.EACCES):
            raise SharedTreeException(f'{place.lock}: {error.strerror}') from error
        raise SharedTreeException(
            f'The process {holder or "?"} already shares {place.what}, and only one can') from None
    return descriptor


class ProcessStatus(NamedTuple):
    """
    What the system knows of a process.

    :ivar stopped: whether a signal or a debugger has stopped it.
    :ivar begun: when it began, clock ticks since the machine started; -1 if there is none.
    """

    stopped: bool
    begun: int


def process_status(pid: int) -> ProcessStatus:
    """
    Return the status of a process.

    In another container, the number may be that of another process, with another ``begun``.
    """
    try:
        # The name comes first, in brackets, and may contain anything: man 5 proc_pid_stat.
        fields = Path(f'/proc/{pid}/stat').read_text(errors='replace').rpartition(')')[2].split()
    except OSError:
        return ProcessStatus(False, -1)
    return ProcessStatus(fields[0] in 'Tt', int(fields[19]))


def is_held(descriptor: int) -> bool:
    """Return whether some process is the writer, without taking the lock."""
    asked = _flock.pack(fcntl.F_WRLCK, 0, 0, 0, 0)
    kind: int = _flock.unpack(fcntl.fcntl(descriptor, fcntl.F_OFD_GETLK, asked))[0]
    return kind != fcntl.F_UNLCK
