# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The lookup audit: each line of code, its lookups, and their value."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
import json
from math import radians

import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import InvalidArgumentException, LATEST, Pose, TransformException
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.reports.audit import Caller, Lookup, LookupAudit, MAX_LINES

NEWEST = from_seconds(2.0)
NOW = from_seconds(2.005)


@pytest.fixture
def buffer():
    """Return a base that drives at 1 m/s and turns at 10 degrees a second, at 100 Hz."""
    buffer = BufferCore()
    for number in range(1, 201):
        seconds = number * 0.01
        buffer.insert('odom', 'base', from_seconds(seconds),
                      Pose.from_xyz_rpy(x=seconds, yaw=radians(10.0) * seconds))
    buffer.insert('base', 'camera', LATEST, Pose(0.2), static=True)
    return buffer


@pytest.fixture
def audit(buffer):
    return LookupAudit(buffer, lambda: NOW)


@pytest.fixture
def lookup(audit, buffer):
    buffer.observers.add(audit)
    return buffer.lookup


def test_watched_lookup_says_and_raises_what_the_lookup_does(lookup, buffer):
    assert lookup('odom', 'base', NEWEST) == buffer.lookup('odom', 'base', NEWEST)
    assert lookup(source_frame='base', target_frame='odom') == buffer.lookup('odom', 'base')
    with pytest.raises(TransformException, match='into the future'):
        lookup('odom', 'base', NOW)
    with pytest.raises(InvalidArgumentException):
        lookup(5, 'base')
    with pytest.raises(TypeError):
        lookup('odom')


def test_line_that_gave_a_stamp_learns_what_the_latest_would_have_cost(audit, lookup):
    lookup('odom', 'base', NEWEST - from_seconds(0.05))
    [line] = audit.lines()
    assert (line.latest, line.stamp_known, line.lookups, line.failed) == (False, False, 1, 0)
    assert line.behind_newest_s == line.apart_s == pytest.approx(0.05)
    assert line.behind_now_s == pytest.approx(0.055)
    assert line.moved_m == pytest.approx(0.05)
    assert line.turned_rad == pytest.approx(radians(0.5))
    assert line.meaning == 'the latest would have cost that'


def test_line_that_asked_for_the_latest_learns_what_100_ms_cost(audit, lookup):
    lookup('odom', 'base')
    [line] = audit.lines()
    assert line.latest and line.behind_newest_s == 0.0
    assert line.behind_now_s == pytest.approx(0.005)
    assert line.moved_m == pytest.approx(0.1) and line.apart_s == pytest.approx(0.1)
    assert line.meaning == 'that is what 100 ms cost'


def test_told_the_stamp_of_the_data_it_knows_what_it_cost(audit, lookup):
    data = NEWEST - from_seconds(0.08)
    for stamp in (LATEST, NEWEST - from_seconds(0.02), data):
        with audit.data_of(data):
            for _ in range(3):
                lookup('odom', 'base', stamp)
    assert [line.lookups for line in audit.lines()] == [3, 6]
    latest, stamped = audit.lines()
    assert latest.latest and latest.stamp_known and latest.meaning == 'that is what it cost'
    assert latest.moved_m == pytest.approx(0.08)
    assert stamped.moved_m == pytest.approx(0.06)
    assert stamped.apart_s == pytest.approx(0.03)


def test_after_it_the_stamp_of_the_data_is_not_known_any_more(audit, lookup):
    with audit.data_of(NEWEST):
        pass
    lookup('odom', 'base')
    assert not audit.lines()[0].stamp_known


def test_lines_of_code_are_told_apart(audit, lookup):
    lookup('odom', 'base')
    lookup('odom', 'base')
    for _ in range(2):
        lookup('odom', 'camera')
    assert [(line.caller.function, line.lookups) for line in audit.lines()] == [
        ('test_lines_of_code_are_told_apart', number) for number in (1, 1, 2)]
    first, second, third = sorted(line.caller.line for line in audit.lines())
    assert (second - first, third - second) == (1, 2)
    assert audit.lines()[0].caller.file == __file__


def test_lookup_that_raises_is_counted_and_not_compared(audit, lookup):
    for stamp in (NOW, NOW, NEWEST):
        with suppress(TransformException):
            lookup('odom', 'base', stamp)
    [line] = audit.lines()
    assert (line.lookups, line.failed, line.compared) == (3, 2, 1)


def test_unknown_frames_and_static_edges_have_no_way_to_compare(audit, lookup):
    with pytest.raises(TransformException):
        lookup('odom', 'nobody')
    lookup('base', 'camera', NEWEST)
    assert [line.compared for line in audit.lines()] == [0, 0]
    assert all(' - ' in line for line in audit.as_text().splitlines()[1:])


def test_what_may_be_wrong_comes_first_and_the_costliest_of_it(audit, lookup, buffer):
    buffer.insert('odom', 'slow', NEWEST - from_seconds(1.0), Pose())
    buffer.insert('odom', 'slow', NEWEST, Pose(0.01))
    lookup('odom', 'base', NEWEST - from_seconds(1.0))
    lookup('odom', 'slow')
    lookup('odom', 'base')
    assert [(line.source, line.latest) for line in audit.lines()] == [
        ('base', True), ('slow', True), ('base', False)]


def test_table_and_json_say_the_same(audit, lookup):
    lookup('odom', 'base')
    [said] = json.loads(audit.as_json())
    assert said['caller']['function'] == 'test_table_and_json_say_the_same'
    assert said['moved_m'] == pytest.approx(0.1) and said['lookups'] == 1
    heading, line = audit.as_text().splitlines()
    assert 'moved at most [cm]' in heading
    assert f'labs/test_audit.py:{said["caller"]["line"]} ' in line and ' 10.00 ' in line


def test_cleared_it_begins_anew(audit, lookup):
    lookup('odom', 'base')
    audit.clear()
    assert audit.lines() == [] and json.loads(audit.as_json()) == []


def test_program_that_makes_up_frames_does_not_fill_the_memory(audit):
    for number in range(MAX_LINES + 10):
        audit.record(Lookup(Caller('f.py', 1, 'f'), 'odom', f'{number}', None, LATEST, NOW,
                            None, LATEST, None))
    assert len(audit.lines()) == MAX_LINES


def test_threads_may_ask_at_once(audit, lookup):
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: lookup('odom', 'base'), range(400)))
    assert [line.lookups for line in audit.lines()] == [400]
