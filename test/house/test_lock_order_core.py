# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The table of locks in docs/design.md, the code, and what busy_buffers.py observes."""

from graphlib import TopologicalSorter
from pathlib import Path
import threading

import lock_order
from lock_order import documented, made_in_package, observed_by, undocumented

PROGRAM = Path(__file__).with_name('busy_buffers.py')


def test_table_has_every_lock_of_the_code_and_no_other():
    rclpy = {name for name in documented() if name.startswith('rclpy.')}
    assert documented().keys() - rclpy == made_in_package()


def test_table_has_no_circle_and_takes_only_what_is_further_down():
    table = documented()
    places = {name: place for place, name in enumerate(table)}
    assert all(places[held] < places[taken] for held in table for taken in table[held])
    tuple(TopologicalSorter(table).static_order())


def test_buffers_take_locks_in_the_documented_order():
    pairs = observed_by(PROGRAM)
    wrong = undocumented(pairs)
    assert not wrong, wrong
    assert {taken for held, taken in pairs if held == 'Queries._lock'} >= {
        'Doctor._lock', 'LookupAudit._lock', lock_order.INNERMOST}
    assert {held for held, taken in pairs if taken == lock_order.INNERMOST} >= {
        'Queries._lock', 'Observers._lock', 'Doctor._lock', 'FlightRecorder._lock'}


def test_pairs_are_those_of_locks_that_a_thread_waits_for(monkeypatch):
    monkeypatch.setattr(lock_order, 'noted', {})
    first, second, third = (
        cls(make(), name) for cls, make, name in (
            (lock_order.Lock, threading.Lock, 'first'),
            (lock_order.RLock, threading.RLock, 'second'),
            (lock_order.RLock, threading.RLock, 'third')))
    with first, second, second:
        assert third.acquire(timeout=1.0)  # gives up, so it is not noted
        changed = threading.Condition(third)
        with changed:
            changed.wait(0.0)
        third.release()
    with second:
        assert not first.locked() and first.acquire(blocking=False)
        with third:
            pass
        first.release()
    assert [*lock_order.noted] == [('first', 'second'), ('first', 'third'), ('second', 'third')]
    assert 'test_pairs_are_those' in lock_order.noted['first', 'second']
