# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The kinds of history that a frozen tree can contain, by name; thawing keeps the kind.

The basic kinds are listed here; every other kind registers itself.
"""

from collections.abc import Callable
from typing import Protocol, TypeVar

from .discrete import DynamicHistory, HeldHistory
from .protocol import History
from .static import StaticHistory
from .storage import Arrays, Facts, Stored
from ..errors import TreeFileError


class Freezable(History, Protocol):
    """A history that can be frozen; its class is in ``KINDS``."""

    def frozen(self, arrays: Arrays) -> Facts:
        """Return facts for ``thawed``, of types that JSON supports, and add its arrays."""

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> History:
        """
        Return the frozen history from its facts and arrays; it need not take samples.

        :raises ValueError: they are not valid for such a history.
        """


KINDS: dict[str, type[Freezable]] = {
    'static': StaticHistory, 'interpolated': DynamicHistory, 'held': HeldHistory}

_Kind = TypeVar('_Kind', bound=type[Freezable])


def storable(name: str) -> Callable[[_Kind], _Kind]:
    """Return a decorator that registers a class of histories under a name."""
    def register(kind: _Kind) -> _Kind:
        KINDS[name] = kind
        return kind
    return register


def frozen(history: History, arrays: Arrays) -> Facts:
    """
    Return the facts of a history for ``thawed``, and add its arrays.

    :raises TreeFileError: it is of a kind that cannot be frozen.
    """
    for name, kind in KINDS.items():
        if type(history) is kind:  # a subclass would be thawed as its base class
            return {'kind': name, 'child': history.child, 'authority': history.authority,
                    **kind.frozen(history, arrays)}
    raise TreeFileError(f'the edge above {history.child!r} cannot be frozen: it is a '
                        f'{type(history).__name__}')


def thawed(stored: Stored) -> History:
    """
    Return the frozen history.

    :raises ValueError: the kind is unknown, or the data is invalid.
    """
    name = stored.one('kind', str)
    if name not in KINDS:
        raise ValueError(f'it contains an edge of the kind {name!r}, which is not installed here')
    history = KINDS[name].thawed(stored.one('child', str), stored)
    history.authority = stored.one('authority', str)
    return history
