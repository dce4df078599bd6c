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

"""
Sources that made way, in the words of a diagnostic status, and back.

A switch between sources happens inside one process. By its diagnostics, live or recorded,
a doctor in another hears of it.
"""

from collections.abc import Iterable, Mapping
import re

from ..arrivals.incidents import Incident, Kind
from ..stamp import format_stamp
from ..tree.sources import Source

DIAGNOSTICS_TOPIC = '/diagnostics'

_KEY = 'Made way: '
_KINDS = {kind.value: kind for kind in (Kind.SOURCE_SILENT, Kind.SOURCE_DIVERGED)}
_VALUE = re.compile(rf'({"|".join(_KINDS)}), at (-?\d+\.\d{{9}}) s: (.*)', re.DOTALL)
_EDGE = re.compile('[^:]*: tf (.+?) -> (.+)', re.DOTALL)
# Anybody may publish diagnostics: beyond this number nothing new is noted.
_MOST = 1_000


def as_values(sources: Iterable[Source]) -> dict[str, str]:
    """Return which sources made way and why, as keys and values of a status."""
    return {f'{_KEY}{source.name}':
            f'{told.kind.value}, at {format_stamp(told.stamp)} s: {told.detail}'
            for source in sources if (told := source.made_way)}


class Hearsay:
    """Hears of sources that made way in other processes, each time once."""

    def __init__(self) -> None:
        """Begin with nothing heard."""
        self._heard: set[tuple[str, str, str]] = set()

    def news(self, status: str, values: Mapping[str, str]) -> list[Incident]:
        """
        Return what a status tells that was not told before.

        :param status: its name, such as ``edge_switch: tf odom -> base_link``.
        """
        edge = _EDGE.fullmatch(status)
        told = [(status, key, value) for key, value in values.items() if key.startswith(_KEY)]
        if edge is None or len(self._heard) > _MOST:
            return []
        fresh = [each for each in told if each not in self._heard]
        self._heard.update(fresh)
        # Nine digits behind the point: without it these are nanoseconds.
        return [Incident(_KINDS[said[1]], edge[1], edge[2], int(said[2].replace('.', '')),
                         key.removeprefix(_KEY), said[3])
                for _, key, value in fresh if (said := _VALUE.fullmatch(value))]
