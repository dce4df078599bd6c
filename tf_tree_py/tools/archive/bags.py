# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Finds bags, on this machine or with fsspec, and copies remote ones to read them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import glob
import hashlib
import os
from pathlib import Path
import re
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from tf_tree_py.bag.files.discovery import INDEX, names_messages
from tf_tree_py.command.endings import Cannot, needs


class BagPath(NamedTuple):
    """
    The place of a bag.

    :ivar path: absolute, or a URL.
    :ivar version: a text that differs whenever the bag has changed; '' if it is unknown.
    """

    path: str
    version: str

    @property
    def name(self) -> str:
        """Return a unique name for files, which begins with the bag's own."""
        digest = hashlib.sha256(self.path.encode(errors='surrogateescape')).hexdigest()[:12]
        own = re.sub(r'[^\w.-]', '_', self.path.rstrip('/').rpartition('/')[2])[:80]
        return f'{own}-{digest}'


def bags_in(patterns: Sequence[str]) -> list[BagPath]:
    """
    Return the bags that match patterns, in order, each once.

    A path without ``*``, ``?`` and ``[`` is returned whether it exists or not. Matches that are
    not bags are left out; the splits of a bag count as one.

    :raises Cannot: nothing matches, or fsspec is needed and fails.
    """
    found = [bag for pattern in patterns
             for bag in (_remote if is_remote(pattern) else _local)(pattern)]
    if not found:
        raise Cannot(f'no bag matches {" ".join(patterns)}')
    return list({bag.path: bag for bag in found}.values())


def is_remote(path: str) -> bool:
    """Return whether fsspec has to open it."""
    return '://' in path or '::' in path


def _local(pattern: str) -> list[BagPath]:
    paths = [pattern]
    if glob.has_magic(pattern):
        paths = _bags_of(sorted(glob.glob(pattern, recursive=True)), os.path.isdir, os.path.exists)
    return [BagPath(path, _version(Path(path))) for path in map(os.path.abspath, paths)]


def _version(path: Path) -> str:
    try:
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        return ' '.join(f'{status.st_size}@{status.st_mtime_ns}'
                        for status in (file.stat() for file in files))
    except OSError:
        return ''


def _remote(pattern: str) -> list[BagPath]:
    system, path, behind = _system_of(pattern)
    try:
        paths = [path]
        if glob.has_magic(path):
            paths = _bags_of(sorted(system.glob(path)), system.isdir, system.exists)
        return [BagPath(system.unstrip_protocol(path) + behind, _remote_version(system, path))
                for path in paths]
    except Exception as error:  # noqa: B902 - each file system has its own errors
        raise Cannot(f'{pattern} cannot be listed: {type(error).__name__}: {error}') from error


def _system_of(url: str) -> tuple[Any, str, str]:
    """Return fsspec's file system for a URL, the path in it, and the chained outer URL."""
    try:
        system, path = needs('fsspec.core', 'fsspec').url_to_fs(url)
    except (ImportError, ValueError, OSError) as error:
        raise Cannot(f'{url} cannot be opened: {error}') from error
    _, chained, outer = url.partition('::')
    return system, path, chained + outer


def _remote_version(system: Any, path: str) -> str:
    try:
        return str(system.info(path).get('size', ''))
    except OSError:
        return ''


def _bags_of(paths: Sequence[str], is_folder: Callable[[str], bool],
             exists: Callable[[str], bool]) -> list[str]:
    """Return the bags among the matches: files, and folders as rosbag2 writes them."""
    bags = list[str]()
    for path in (path.rstrip('/') for path in paths):
        folder = path if is_folder(path) else path.rpartition('/')[0]
        if exists(f'{folder}/{INDEX}' if folder else INDEX):
            bags.append(folder or '.')
        elif folder != path and names_messages(path):
            bags.append(path)
    return list(dict.fromkeys(bags))


@contextmanager
def local_copy(path: str) -> Iterator[Path]:
    """Yield the path of a bag on this machine; a copy is deleted afterwards."""
    if not is_remote(path):
        yield Path(path)
        return
    system, inner, _ = _system_of(path)
    with TemporaryDirectory() as folder:
        copy = Path(folder, inner.rstrip('/').rpartition('/')[2])
        system.get(inner, str(copy), recursive=system.isdir(inner))
        yield copy
