# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Suggestions of the frame name that a caller probably meant."""

from collections.abc import Iterable
import difflib

# More names than this, and long names, are not compared, because that takes too long.
_MAX_NAMES = 1000
_MAX_LENGTH = 200
# How many names a hint lists.
_LISTED = 12


def nearest(name: str, names: Iterable[str]) -> str | None:
    """Return the name that is most similar to another; None if none is similar."""
    if len(name) > _MAX_LENGTH:
        return None
    candidates = [other for other in list(names)[:_MAX_NAMES] if len(other) <= _MAX_LENGTH]
    found = difflib.get_close_matches(name, candidates, 1)
    return found[0] if found else None


def known_names(name: str, names: tuple[str, ...]) -> str:
    """Return a hint about an unknown name, with the most similar names first."""
    meant = nearest(name, names)
    parts = _containing(name, names)
    first = list(dict.fromkeys([*([meant] if meant else []), *parts]))
    ordered = [*first, *(other for other in names if other not in first)]
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    known = 'Known: ' + ', '.join(ordered[:_LISTED]) + more
    if meant is not None:
        return f'Did you mean {meant!r}? {known}'
    if len(parts) == 1:
        return f'Did you mean {parts[0]!r}? {known}'
    return f'{len(parts)} frames have {name!r} in their names. {known}' if parts else known


def _containing(name: str, names: tuple[str, ...]) -> list[str]:
    """Return the names that contain another one, the shortest first."""
    if not 2 < len(name) <= _MAX_LENGTH:
        return []
    part = name.lower()
    return sorted((other for other in names if part in other.lower()), key=len)
