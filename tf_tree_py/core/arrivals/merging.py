"""Tables of counts put together: those of two buffers, or of two parts of a recording."""

from collections.abc import Hashable, Mapping
from typing import Any, Protocol, TypeVar


class Addable(Protocol):
    """What can be added to another of its kind, in any order."""

    def __add__(self, other: Any, /) -> Any:
        """Return the two together."""


Key = TypeVar('Key', bound=Hashable)
Value = TypeVar('Value', bound=Addable)


def merged(*tables: Mapping[Key, Value]) -> dict[Key, Value]:
    """
    Return one table of all: values that have the same key are added.

    The values are ``Arrivals`` by edge, ``IncidentGroup`` by kind and edge, or plain
    counts. Which tables are merged first makes no difference.
    """
    together: dict[Key, Value] = {}
    for table in tables:
        for key, value in table.items():
            together[key] = together[key] + value if key in together else value
    return together
