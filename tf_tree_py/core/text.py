# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Text for errors: other nodes choose frame names, with any length and any characters."""

from collections.abc import Sequence

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


def times(count: int) -> str:
    """Return a number of times, in words."""
    return {1: 'once', 2: 'twice'}.get(count, f'{count} times')
