# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""All kinds of history that a frozen tree can have, by name: each is thawed as its own kind."""

from typing import Protocol

from .aided import AidedHistory
from .corrected import CorrectedAidedSamples, CorrectedSamples
from .discrete import DynamicHistory, HeldHistory
from .protocol import History
from .spline_history import SplineHistory
from .static import StaticHistory
from .storage import Arrays, Facts, Stored
from ..errors import TreeFileError


class Freezable(History, Protocol):
    """A history that can be frozen; it is entered in ``KINDS``."""

    def frozen(self, arrays: Arrays) -> Facts:
        """Return facts, which JSON can hold, for ``thawed``, and add its arrays."""

    @classmethod
    def thawed(cls, child: str, stored: Stored) -> History:
        """
        Return what was frozen, by the same facts and arrays; it need take no sample.

        :raises ValueError: they cannot be those of such a history.
        """


KINDS: dict[str, type[Freezable]] = {
    'static': StaticHistory, 'interpolated': DynamicHistory, 'held': HeldHistory,
    'aided': AidedHistory, 'spline': SplineHistory, 'corrected': CorrectedSamples,
    'corrected and aided': CorrectedAidedSamples}


def frozen(history: History, arrays: Arrays) -> Facts:
    """
    Return what ``thawed`` makes a history of, and add its arrays.

    :raises TreeFileError: it is of a kind that cannot be frozen.
    """
    for name, kind in KINDS.items():
        if type(history) is kind:  # a class that derives from it would be thawed as its base
            return {'kind': name, 'child': history.child, 'authority': history.authority,
                    **kind.frozen(history, arrays)}
    raise TreeFileError(f'the edge above {history.child!r} cannot be frozen: it is a '
                        f'{type(history).__name__}')


def thawed(stored: Stored) -> History:
    """
    Return the history that was frozen.

    :raises ValueError: there is no such kind, or not enough for one.
    """
    name = stored.one('kind', str)
    if name not in KINDS:
        raise ValueError(f'there is no kind of edge {name!r}')
    history = KINDS[name].thawed(stored.one('child', str), stored)
    history.authority = stored.one('authority', str)
    return history
