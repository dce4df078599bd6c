"""Which name was meant."""

from collections.abc import Iterable
import difflib

# More names, and longer ones, are not compared: that takes time, and somebody waits.
_MAX_NAMES = 1000
_MAX_LENGTH = 200
# So many names are listed.
_LISTED = 12


def nearest(name: str, names: Iterable[str]) -> str | None:
    """Return the name that is most like one; None if none is."""
    if len(name) > _MAX_LENGTH:
        return None
    candidates = [other for other in list(names)[:_MAX_NAMES] if len(other) <= _MAX_LENGTH]
    found = difflib.get_close_matches(name, candidates, 1)
    return found[0] if found else None


def known_names(name: str, names: tuple[str, ...]) -> str:
    """Return a hint for who used a name that is none of those known."""
    meant = nearest(name, names)
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    known = 'Known: ' + ', '.join(names[:_LISTED]) + more
    return known if meant is None else f'Did you mean {meant!r}? {known}'
