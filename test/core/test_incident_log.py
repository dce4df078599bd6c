# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The log of incidents: few lines, each with the necessary details."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

from hand_clock import HandClock
import pytest
from tf_tree_py import Incident
from tf_tree_py.core import Kind
from tf_tree_py.core.messages import incidents
from tf_tree_py.core.messages.incidents import IncidentLog

REFUSED = "Refused transform 'map' -> 'odom' from '/somebody' "


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr(incidents, 'time', clock)
    return clock


@pytest.fixture
def lines():
    return []


@pytest.fixture
def log(lines, clock):
    return IncidentLog(SimpleNamespace(warning=lines.append))


def incident(kind=Kind.OLD_DATA, child='odom'):
    return Incident(kind, 'map', child, 1, '/somebody', 'because')


def test_edge_is_logged_once_a_kind_and_period_and_then_counted(log, lines, clock):
    for _ in range(42):
        log.report([incident(), incident(Kind.SELF_EDGE)])
        clock.now += 0.2
    old, itself = (f'({kind.value}): because' for kind in (Kind.OLD_DATA, Kind.SELF_EDGE))
    assert lines == [REFUSED + old, REFUSED + itself]
    clock.now += 1.7
    log.report([incident()])
    assert lines[2:] == [f'41 more like this: {Kind.OLD_DATA.value}',
                         f'41 more like this: {Kind.SELF_EDGE.value}', REFUSED + old]
    clock.now += 10.1
    log.report([incident()])
    assert lines[5:] == [REFUSED + old], 'nothing was left out this time'


def test_flood_of_names_takes_few_lines_and_little_memory(log, lines):
    log.report([incident(child=f'c{i}') for i in range(10_000)])
    assert len(lines) == 5
    assert len(log._shown) == 5
    log.report([incident(Kind.LOOP, child=f'c{i}') for i in range(3)])
    assert len(lines) == 8


def test_line_of_a_dying_logger_does_not_hold_up_the_next(clock):
    log = IncidentLog(SimpleNamespace())
    with pytest.raises(AttributeError):
        log.report([incident()])
    log.report([incident()])


def test_threads_that_report_at_once_lose_no_count(log, lines, clock):
    with ThreadPoolExecutor() as threads:
        threads.map(lambda _: [log.report([incident()]) for _ in range(500)], range(4))
    assert len(lines) == 1
    clock.now += 11.0
    log.report([incident()])
    assert lines[1] == '1999 more like this: older than the buffer keeps'
