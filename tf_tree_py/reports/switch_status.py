# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Replaced sources, written to a diagnostic status and read from it.

A switch between sources happens inside one process. Its diagnostics, live or recorded, report
it to a doctor in another process.
"""

from collections.abc import Iterable, Mapping
import re

from tf_tree_py.beyond.sources.source_samples import EdgeSource
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.stamp import format_stamp

DIAGNOSTICS_TOPIC = '/diagnostics'

_KEY = 'Made way: '
_KINDS = {kind.value: kind for kind in (
    Kind.SOURCE_SILENT, Kind.SOURCE_DIVERGED, Kind.SOURCE_PREFERRED)}
_VALUE = re.compile(rf'({"|".join(_KINDS)}), at (-?\d+\.\d{{9}}) s: (.*)', re.DOTALL)
_EDGE = re.compile('[^:]*: tf (.+?) -> (.+)', re.DOTALL)
# Any node may publish diagnostics: beyond this number, new reports are ignored.
_MOST = 1_000


def as_values(sources: Iterable[EdgeSource]) -> dict[str, str]:
    """Return the replaced sources and the reasons, as keys and values of a status."""
    return {f'{_KEY}{source.name}':
            f'{incident.kind.value}, at {format_stamp(incident.stamp)} s: {incident.detail}'
            for source in sources if (incident := source.made_way)}


class SwitchReports:
    """Finds the replacements of sources in statuses of other processes, each one once."""

    def __init__(self) -> None:
        """Start without reports."""
        self._known: set[tuple[str, str, str]] = set()

    def news(self, status: str, values: Mapping[str, str]) -> list[Incident]:
        """
        Return the incidents in a status that no earlier status contained.

        :param status: its name, such as ``edge_switch: tf odom -> base_link``.
        """
        edge = _EDGE.fullmatch(status)
        reports = [(status, key, value) for key, value in values.items() if key.startswith(_KEY)]
        if edge is None or len(self._known) > _MOST:
            return []
        fresh = [report for report in reports if report not in self._known]
        self._known.update(fresh)
        # There are nine digits after the point: without the point these are nanoseconds.
        return [Incident(_KINDS[parts[1]], edge[1], edge[2], int(parts[2].replace('.', '')),
                         key.removeprefix(_KEY), parts[3])
                for _, key, value in fresh if (parts := _VALUE.fullmatch(value))]
