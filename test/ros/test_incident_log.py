# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The log of incidents: few lines, each with the necessary details."""

import itertools
import threading

from hand_clock import HandClock
import pytest
from tf_tree_py import Incident
from tf_tree_py.core import Kind
from tf_tree_py.core.ingest import incident_log
from tf_tree_py.core.ingest.incident_log import IncidentLog


class Lines(list):
    """A logger that stores its lines."""

    def warning(self, line):
        self.append(line)


@pytest.fixture
def clock(monkeypatch):
    clock = HandClock(1000.0)
    monkeypatch.setattr(incident_log, 'time', clock)
    return clock


@pytest.fixture
def lines():
    return Lines()


@pytest.fixture
def log(lines, clock):
    return IncidentLog(lines)


def incident(kind=Kind.OLD_DATA, parent='map', child='odom', detail='because'):
    return Incident(kind, parent, child, 1, '/somebody', detail)


def test_line_says_what_who_and_why(log, lines):
    log.report([incident()])
    assert lines == ["Refused transform 'map' -> 'odom' from '/somebody' "
                     '(older than the buffer keeps): because']


def test_remark_is_told_from_a_refusal(log, lines):
    log.report([incident(Kind.KIND_CHANGE)])
    assert lines[0].startswith("Note on transform 'map' -> 'odom'")


def test_edge_is_told_once_a_kind_and_period(log, lines, clock):
    for _ in range(1000):
        log.report([incident(), incident(Kind.LOOP)])
        clock.now += 0.009
    assert len(lines) == 2


def test_few_edges_of_a_kind_are_told_a_period(log, lines):
    log.report([incident(child=f'c{i}') for i in range(1000)])
    assert len(lines) == 5
    log.report([incident(Kind.LOOP, child=f'c{i}') for i in range(3)])
    assert len(lines) == 8


def test_what_was_left_out_is_counted_when_the_next_period_begins(log, lines, clock):
    for _ in range(42):
        log.report([incident(), incident(Kind.SELF_EDGE)])
    lines.clear()
    clock.now += 10.1
    log.report([incident()])
    assert lines[:-1] == ['41 more like this: older than the buffer keeps',
                          '41 more like this: frame is its own parent']
    assert lines[-1].startswith("Refused transform 'map' -> 'odom'")
    clock.now += 10.1
    lines.clear()
    log.report([incident()])
    assert len(lines) == 1, 'nothing was left out this time'


def test_line_of_a_dying_logger_does_not_hold_up_the_next(lines, clock):
    class Broken:

        def warning(self, line):
            raise RuntimeError(line)

    log = IncidentLog(Broken())
    with pytest.raises(RuntimeError):
        log.report([incident()])
    log.report([incident()])


def test_threads_that_report_at_once_lose_no_count(log, lines, clock):
    threads = [threading.Thread(target=lambda: [log.report([incident()]) for _ in range(500)])
               for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(lines) == 1
    clock.now += 11.0
    log.report([incident()])
    assert lines[1] == '1999 more like this: older than the buffer keeps'


def test_flood_of_names_takes_no_memory_for_long(log, clock):
    for i in itertools.islice(itertools.count(), 10_000):
        log.report([incident(child=f'c{i}')])
    assert len(log._shown) <= 5 * len(Kind)
