# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``Buffer(audit=True)`` audits tf2's own methods; without it, nothing is recorded."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
import time

from inputs import for_each
import pytest
from rclpy.duration import Duration
from rclpy.time import Time
from ros_helpers import until
from tf_tree_py import Buffer, Pose, TransformException

BEGIN = time.time_ns() - 2_000_000_000


def filled(**options):
    """Return a buffer with two seconds of driving at 1 m/s, up to now."""
    buffer = Buffer(**options)
    for number in range(201):
        buffer.insert('odom', 'base', BEGIN + number * 10_000_000, Pose(x=number * 0.01))
    return buffer


def at(seconds):
    return Time(nanoseconds=BEGIN + round(seconds * 1e9))


def test_each_call_is_one_line_whatever_it_looks_up_with():
    buffer = filled(audit=True)
    buffer.lookup_transform('odom', 'base', at(1.9))
    buffer.lookup_transform('odom', 'base', at(1.9).to_msg(), Duration(seconds=1))
    buffer.lookup('odom', 'base', BEGIN + 1_900_000_000)
    lines = buffer.audit.lines()
    assert len(lines) == 3
    for line in lines:
        assert (line.lookups, line.failed, line.latest) == (1, 0, False)
        assert line.moved_m == pytest.approx(0.1, abs=1e-6)
        assert line.caller.file == __file__
        assert 0.0 < line.behind_now_s < (time.time_ns() - BEGIN) / 1e9


def test_latest_and_failures_are_counted():
    buffer = filled(audit=True)
    for moment in (Time(), Time(), at(2.1)):
        with suppress(TransformException):
            buffer.lookup_transform('odom', 'base', moment, Duration(nanoseconds=1))
    latest, late = sorted(buffer.audit.lines(), key=lambda line: not line.latest)
    assert (latest.lookups, latest.failed) == (2, 0)
    assert (late.lookups, late.failed) == (1, 1)


def test_can_transform_is_asking_too():
    buffer = filled(audit=True)
    assert buffer.can_transform('odom', 'base', at(1.0))
    [line] = buffer.audit.lines()
    assert line.caller.function == 'test_can_transform_is_asking_too'


async def awaited(buffer):
    return await buffer.lookup_transform_async('odom', 'base', at(1.0))


KINDS = {
    'lookup': lambda buffer: buffer.lookup('odom', 'base', BEGIN + 10**9),
    'lookup_stamped': lambda buffer: buffer.lookup_stamped('odom', 'base', BEGIN + 10**9),
    'lookup_at': lambda buffer: buffer.lookup_at('odom', 'base', BEGIN + 10**9),
    'lookup_within': lambda buffer: buffer.lookup_within(1.0, 'odom', 'base', BEGIN + 10**9),
    'lookup_many': lambda buffer: buffer.lookup_many('odom', 'base', [BEGIN, BEGIN + 10**9]),
    'lookup_full': lambda buffer: buffer.lookup_full(
        'odom', BEGIN + 10**9, 'base', BEGIN + 10**9, 'odom'),
    'lookup_transform': lambda buffer: buffer.lookup_transform('odom', 'base', at(1.0)),
    'lookup_transform_core': lambda buffer: buffer.lookup_transform_core(
        'odom', 'base', at(1.0)),
    'lookup_transform_full': lambda buffer: buffer.lookup_transform_full(
        'odom', at(1.0), 'base', at(1.0), 'odom', Duration(seconds=1)),
    'wait_for_transform_async': lambda buffer: buffer.wait_for_transform_async(
        'odom', 'base', at(1.0)),
    'wait_for_transform_full_async': lambda buffer: buffer.wait_for_transform_full_async(
        'odom', at(1.0), 'base', at(1.0), 'odom'),
    'lookup_transform_async': lambda buffer: asyncio.run(awaited(buffer)),
    'can_transform': lambda buffer: buffer.can_transform('odom', 'base', at(1.0)),
}


@for_each(kind=KINDS)
def test_every_kind_of_lookup_is_seen_once(kind):
    buffer = filled(audit=True)
    KINDS[kind](buffer)
    lines = buffer.audit.lines()
    # A lookup between two times counts as its two halves, here odom <- base and odom <- odom.
    assert [(line.source, line.lookups, line.failed, line.latest) for line in lines] == [
        (source, 1, 0, False) for source in (('base', 'odom') if 'full' in kind else ('base',))]
    assert {line.caller.file for line in lines} == {__file__}
    assert lines[0].behind_newest_s == pytest.approx(1.0)


def test_lookup_that_waits_is_one_however_often_it_tries():
    buffer = filled(audit=True)
    end = BEGIN + 2 * 10**9
    futures = [buffer.wait_for_transform_async('odom', 'base', at(2.1), timeout)
               for timeout in (None, Duration(seconds=100))]
    with ThreadPoolExecutor() as pool:
        sleeper = pool.submit(
            buffer.lookup_transform, 'odom', 'base', at(2.1), Duration(seconds=100))
        until(lambda: len(buffer.waiting) == 3)
        for stamp in (end + 5 * 10**7, end + 10**8):
            # Waiting lookups are repeated whenever the structure changes.
            buffer.insert('base', f'camera{stamp}', 0, Pose(), static=True)
            buffer.insert('odom', 'base', stamp, Pose())
        assert sleeper.result().child_frame_id == 'base'
    assert all(future.done() for future in futures)
    lines = buffer.audit.lines()
    # The two futures are created by one line of code.
    assert sorted((line.lookups, line.failed) for line in lines) == [(1, 0), (2, 0)]


def test_future_that_fails_is_a_lookup_that_failed():
    buffer = filled(audit=True)
    future = buffer.wait_for_transform_async('odom', 'base', at(-100.0))
    assert isinstance(future.exception(), TransformException)
    [line] = buffer.audit.lines()
    assert (line.lookups, line.failed) == (1, 1)


def test_without_an_audit_a_buffer_has_nothing_of_it():
    buffer = filled()
    assert buffer.audit is None
    assert len(buffer.observers) == 0
