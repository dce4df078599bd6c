"""Shortening text: other nodes choose frame names, and a name may be of any length."""

from collections.abc import Sequence

LONGEST_TEXT = 4000
"""Characters of a sentence in an error or an incident; a longer one loses its middle."""


def shorten(text: str, most: int = LONGEST_TEXT) -> str:
    """
    Return a text; if it is too long, its two ends and its length.

    :param most: how many of its characters are kept; the length is written besides.
    """
    if len(text) <= most:
        return text
    end = most // 2
    return f'{text[:end]}... ({len(text)} characters) ...{text[len(text) - end:]}'


def listed(names: Sequence[str], most: int = 5, longest: int = 80) -> str:
    """Return the first of some names, each shortened, and how many more there are."""
    told = ', '.join(shorten(name, longest) for name in names[:most])
    return told + (f' and {len(names) - most} more' if len(names) > most else '')


def times(count: int) -> str:
    """Return how often, in words."""
    return {1: 'once', 2: 'twice'}.get(count, f'{count} times')
