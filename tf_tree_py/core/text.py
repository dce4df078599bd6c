# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Text for errors: shortened names, and the name that a caller probably meant.

Other nodes choose frame names, with any length and any characters. Pure functions: no state, any
thread.
"""

from collections.abc import Iterable, Sequence
import difflib

LONGEST_TEXT = 4000
"""The maximum characters of a text in an error or an incident; longer ones lose their middle."""


def shorten(text: str, most: int = LONGEST_TEXT) -> str:
    """
    Return a text, or, if it is too long, its two ends and its length.

    :param most: how many of its characters are kept; the length is added to these.
    """
    if len(text) <= most:
        return text
    end = most // 2
    return f'{text[:end]}... ({len(text)} characters) ...{text[len(text) - end:]}'


def printable(text: str) -> str:
    """Return a text in which control characters are escaped, so that it stays one line."""
    return ''.join(char if char.isprintable() else repr(char)[1:-1] for char in text)


def listed(names: Sequence[str], most: int = 5, longest: int = 80) -> str:
    """Return the first of some names, each shortened, and how many more there are."""
    first = ', '.join(shorten(name, longest) for name in names[:most])
    return first + (f' and {len(names) - most} more' if len(names) > most else '')


# --- suggestions

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
    found = difflib.get_close_matches(name, candidates)
    return found[0] if found else None


def known_names(name: str, names: tuple[str, ...]) -> str:
    """Return a hint about an unknown name, with the most similar names first."""
    meant = nearest(name, names)
    parts = _containing(name, names)
    first = list(dict.fromkeys([*([meant] if meant else []), *parts]))
    ordered = [*first, *(other for other in names if other not in first)]
    more = f' and {len(names) - _LISTED} more (frames() lists all)' if len(names) > _LISTED else ''
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
