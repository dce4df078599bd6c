# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What incidents say, how they are counted, and which publishers they name."""

from inputs import for_each
import pytest
from tf_tree_py.core import Incident, Kind, LATEST, RefusedException, Statistics
from tf_tree_py.core.messages.incidents import (
    candidates,
    count_refused,
    is_ambiguous,
    one_of,
    REMARKS,
)


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


def test_counts_are_listed_in_the_order_of_the_kinds():
    assert str(Statistics()) == '0 accepted, 0 refused, 0 frames'
    statistics = Statistics(5, frames=3)
    statistics.incidents[Kind.JUMP_BACK] = 1
    statistics.incidents[Kind.MALFORMED] = 2
    statistics.incidents[Kind.LOOP] = 4
    assert str(statistics) == ('5 accepted, 6 refused, 3 frames; malformed message: 2; '
                               'would close a loop: 4; stamps jumped back: 1')
    assert count_refused({Kind.LOOP: 4, Kind.JUMP_BACK: 1}) == 4
    assert Statistics().incidents is not Statistics().incidents


def test_incident_has_no_newest_stamp_by_default():
    incident = Incident(Kind.LOOP, 'map', 'odom', 5, 'somebody', 'because')
    assert incident.newest == LATEST
    assert RefusedException('text', incidents=(incident,)).incidents == [incident]
    assert RefusedException('text').incidents == []


@pytest.mark.parametrize(('field', 'most'), [
    ('parent', 1024), ('child', 1024), ('authority', 4000), ('detail', 4000)])
def test_long_texts_of_an_incident_lose_their_middle(field, most):
    texts = {'parent': 'p', 'child': 'c', 'authority': 'a', 'detail': 'd'}
    for length in (most, most + 1):
        incident = Incident(Kind.LOOP, stamp=5, newest=6, **texts | {field: 'x' * length})
        shown = 'x' * most if length == most else (
            f'{"x" * (most // 2)}... ({length} characters) ...{"x" * (most // 2)}')
        got = {name: getattr(incident, name) for name in texts}
        assert got == texts | {field: shown}
        assert (incident.kind, incident.stamp, incident.newest) == (Kind.LOOP, 5, 6)


NAMES = [f'/node{number:02}' for number in range(14)]


@pytest.mark.parametrize(('names', 'authority', 'listed'), [
    (['/b'], '/b', ['/b']), (['/b', '/a'], 'one of /a, /b', ['/a', '/b']),
    (NAMES[11::-1], f'one of {", ".join(NAMES[:12])}', NAMES[:12]),
    (NAMES[12::-1], f'one of {", ".join(NAMES[:12])} and 1 more', NAMES[:12]),
    (NAMES, f'one of {", ".join(NAMES[:12])} and 2 more', NAMES[:12])],
    ids=['one', 'two', 'twelve', 'thirteen', 'fourteen'])
def test_several_publishers_are_one_authority(names, authority, listed):
    assert one_of(names) == authority
    assert one_of(dict.fromkeys(names).keys()) == authority
    assert is_ambiguous(authority) is (len(names) > 1)
    assert candidates(authority) == listed


def test_unknown_publisher_has_no_candidates():
    assert candidates('') == []
    assert not is_ambiguous('')
    assert not is_ambiguous('/one of ')
    assert candidates('/a, /b') == ['/a, /b']
