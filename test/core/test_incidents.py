# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

from inputs import for_each
from tf_tree_py.core import Incident, Kind, Statistics
from tf_tree_py.core.messages.incidents import REMARKS


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
