# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Python warnings and exceptions about refused transforms that a program inserted."""

from collections.abc import Hashable
import warnings

from ..messages.incidents import Incident, RefusedException, TransformWarning

# The stack up to the line that inserts: _warn, the method here that calls it, the method of
# the buffer, and that line.
_STACK_LEVEL = 4


class RefusalWarnings:
    """Raises an exception about refused transforms, or warns once for each kind, or neither."""

    def __init__(self) -> None:
        self._warned: set[Hashable] = set()

    def report(self, incidents: list[Incident], strict: bool | None) -> list[Incident]:
        """
        Report incidents to the caller of the method that calls this one, and return them.

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
            self._warn(incident.kind, f'{incident}. Later incidents of this kind cause no '
                                      'warning: the call returns them, and statistics() counts '
                                      'them. Pass strict=True to raise an exception instead')
        return incidents

    def report_lost(self, text: str) -> None:
        """Warn about samples that were older than the buffer keeps when they were inserted."""
        self._warn('window', text)

    def _warn(self, what: Hashable, text: str) -> None:
        if what not in self._warned:
            self._warned.add(what)
            warnings.warn(text, TransformWarning, stacklevel=_STACK_LEVEL)
