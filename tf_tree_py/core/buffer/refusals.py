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

"""Telling a program what was refused of what it inserts by itself."""

from collections.abc import Hashable
import warnings

from ..arrivals.incidents import Incident, RefusedException, TransformWarning

# Up to the line that inserts: _warn, the method here that calls it, the buffer's, that line.
_STACK_LEVEL = 4


class Refusals:
    """Raises what was refused, or warns of it once for each kind, or does neither."""

    def __init__(self) -> None:
        self._warned: set[Hashable] = set()

    def report(self, incidents: list[Incident], strict: bool | None) -> list[Incident]:
        """
        Return incidents, told to the caller of the method that calls this.

        :param strict: see ``BufferCore.insert``.
        :raises RefusedException: with ``strict``, if one of them was refused.
        """
        if not incidents or strict is False:
            return incidents
        refused = [incident for incident in incidents if incident.refused]
        if strict and refused:
            more = f' ({len(refused)} were refused)' if len(refused) > 1 else ''
            raise RefusedException(f'{refused[0]}{more}', incidents=refused)
        for incident in incidents:
            self._warn(incident.kind, f'{incident}. Of this kind that was the first, and no more '
                                      'are told here: the call returns them, and statistics() '
                                      'counts them; strict=True raises them')
        return incidents

    def report_lost(self, text: str) -> None:
        """Warn of samples that were older than the buffer keeps when they came."""
        self._warn('window', text)

    def _warn(self, what: Hashable, text: str) -> None:
        if what not in self._warned:
            self._warned.add(what)
            warnings.warn(text, TransformWarning, stacklevel=_STACK_LEVEL)
