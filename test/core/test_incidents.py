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

from inputs import for_each
from tf_tree_py.core import Incident, Kind, Statistics
from tf_tree_py.core.arrivals.incidents import REMARKS


@for_each(kind=Kind)
def test_every_kind_is_a_refusal_or_a_remark(kind):
    incident = Incident(kind, 'map', 'odom', 5, 'somebody', 'because')
    assert incident.refused == (kind not in REMARKS)
    assert str(incident) == (
        f"{'Refused' if incident.refused else 'Note on'} transform 'map' -> 'odom' "
        f"from 'somebody' ({kind.value}): because")


def test_fresh_statistics_count_nothing_of_every_kind():
    statistics = Statistics()
    assert (statistics.accepted, statistics.refused, statistics.frames) == (0, 0, 0)
    assert set(statistics.incidents) == set(Kind)


def test_remarks_are_not_counted_as_refused():
    statistics = Statistics()
    for kind in Kind:
        statistics.incidents[kind] = 1
    assert statistics.refused == len(Kind) - len(REMARKS)
