# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Keeps what was built for the next environment with the same wheels, outside of all of them.

Each build has a folder of its own below the user's cache, whose name is a hash of all that the
build depends on. A build that does not load is made again (``building.build``).
"""

from collections.abc import Iterable
from contextlib import suppress
import hashlib
from importlib.metadata import distributions
import os
from pathlib import Path
import platform
import shutil
import sysconfig
import tempfile


class Kept:
    """The place of one build in a cache."""

    def __init__(self, cache: Path, sources: Iterable[Path]) -> None:
        """
        Name the place.

        :param cache: the folder of all builds; it is made when one is kept.
        :param sources: the files that determine the build, besides the installed wheels, the
            Python, the compiler and the machine.
        """
        self._cache = cache
        self._folder = cache / _hash_of(sources)

    def find(self) -> Path | None:
        """
        Return the folder of the build, if there is one.

        As pip does, it ignores a cache that another user could have written.
        """
        try:
            status = self._cache.stat()
        except OSError:
            return None
        if status.st_uid != os.getuid() or status.st_mode & 0o022:
            return None
        return self._folder if self._folder.is_dir() else None

    def keep(self, image: Path) -> None:
        """Copy a build into its place, at once; a cache that cannot be written stays as it is."""
        with suppress(OSError):
            self._cache.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=self._cache) as folder:
                copy = shutil.copytree(image, Path(folder, 'image'), symlinks=True)
                # One that is there did not load, or another process has just made the same.
                shutil.rmtree(self._folder, ignore_errors=True)
                copy.rename(self._folder)


def user_cache() -> Path | None:
    """Return the folder of this user's builds, where the XDG base directories have it."""
    named = os.environ.get('XDG_CACHE_HOME', '')
    try:
        cache = Path(named) if os.path.isabs(named) else Path.home() / '.cache'
    except RuntimeError:  # a user without a home
        return None
    return cache / 'tf_tree_py' / 'tf2_msgs'


def _hash_of(sources: Iterable[Path]) -> str:
    parts = [*_wheels(), str(sysconfig.get_config_var('SOABI')), sysconfig.get_platform(),
             *platform.libc_ver(), os.environ.get('CXX', '')]
    found = hashlib.sha256('\0'.join(parts).encode())
    for file in sorted(sources):
        found.update(b'\0' + file.name.encode() + b'\0' + file.read_bytes())
    return found.hexdigest()[:32]


def _wheels() -> list[str]:
    """Return the names and versions of what is installed that the build reads or links."""
    names = {name: distribution.version for distribution in distributions()
             if (name := distribution.metadata['Name'] or '').startswith('ros-')
             or name in ('numpy', 'empy')}
    # Those of the linters are there or not.
    return sorted(f'{name} {version}' for name, version in names.items() if 'ament' not in name)
