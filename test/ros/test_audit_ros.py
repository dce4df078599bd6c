# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``Buffer(audit=True)`` audits tf2's own methods; without it, nothing is recorded."""

import asyncio

from inputs import for_each
import pytest
from rclpy.duration import Duration
from ros_helpers import at, LATEST, PATIENCE, simulated_clock, until_waiting
from tf_tree_py import Buffer, Pose, TransformException


def filled(**options):
    """Return a buffer with two seconds of driving at 1 m/s."""
    buffer = Buffer(**options)
    for number in range(201):
        buffer.insert('odom', 'base', at(10.0 + number / 100), Pose(x=number / 100))
    return buffer


def test_each_call_is_one_line_whatever_it_looks_up_with():
    buffer = filled(audit=True)
    buffer.use_clock(simulated_clock(13.0))
    buffer.lookup_transform('odom', 'base', at(11.9))
    buffer.lookup_transform('odom', 'base', at(11.9).to_msg(), Duration(seconds=1))
    buffer.lookup('odom', 'base', at(11.9).nanoseconds)
    lines = buffer.audit.lines()
    assert len(lines) == 3
    for line in lines:
        assert (line.lookups, line.failed, line.latest) == (1, 0, False)
        assert line.moved_m == pytest.approx(0.1, abs=1e-6)
        assert line.caller.file == __file__
        assert line.caller.function == 'test_each_call_is_one_line_whatever_it_looks_up_with'
        assert line.behind_now_s == pytest.approx(1.1, abs=1e-9)


def test_latest_lookups_and_failures_are_counted():
    buffer = filled(audit=True)
    for _ in range(2):
        buffer.lookup_transform('odom', 'base', LATEST)
    with pytest.raises(TransformException):
        buffer.lookup_transform('odom', 'base', at(12.1), Duration(nanoseconds=1))
    future = buffer.wait_for_transform_async('odom', 'base', at(1.0))
    assert isinstance(future.exception(), TransformException)
    assert [(line.latest, line.lookups, line.failed) for line in sorted(
        buffer.audit.lines(), key=lambda line: line.caller.line)] == [
            (True, 2, 0), (False, 1, 1), (False, 1, 1)]


# A lookup between two times counts as its two halves, here odom <- base and odom <- odom.
FULL = {'lookup_full', 'lookup_transform_full', 'wait_for_transform_full_async'}
METHODS = {
    **dict.fromkeys(
        ('lookup', 'lookup_stamped', 'lookup_at', 'lookup_transform', 'lookup_transform_core',
         'lookup_transform_async', 'wait_for_transform_async', 'can_transform'),
        ('odom', 'base', at(11.0))),
    'lookup_within': (1.0, 'odom', 'base', at(11.0)),
    'lookup_many': ('odom', 'base', [at(10.0), at(11.0)]),
    **dict.fromkeys(FULL, ('odom', at(11.0), 'base', at(11.0), 'odom')),
}


@for_each(method=METHODS)
def test_every_kind_of_lookup_is_seen_once(method):
    buffer = filled(audit=True)

    async def awaited():
        return await buffer.lookup_transform_async(*METHODS[method])

    if method == 'lookup_transform_async':
        asyncio.run(awaited())
    else:
        getattr(buffer, method)(*METHODS[method])
    lines = buffer.audit.lines()
    assert [(line.source, line.lookups, line.failed, line.latest) for line in lines] == [
        (source, 1, 0, False) for source in (('base', 'odom') if method in FULL else ('base',))]
    assert {line.caller.file for line in lines} == {__file__}
    assert lines[0].behind_newest_s == pytest.approx(1.0)


def test_lookup_that_waits_is_one_however_often_it_tries(pool):
    buffer = filled(audit=True)
    futures = [buffer.wait_for_transform_async('odom', 'base', at(12.1), timeout)
               for timeout in (None, PATIENCE)]
    sleeper = pool.submit(buffer.lookup_transform, 'odom', 'base', at(12.1), PATIENCE)
    until_waiting(buffer, 3)
    for stamp in (at(12.05).nanoseconds, at(12.1).nanoseconds):
        # Waiting lookups are repeated whenever the structure changes.
        buffer.insert('base', f'camera{stamp}', 0, Pose(), static=True)
        buffer.insert('odom', 'base', stamp, Pose())
    assert sleeper.result().child_frame_id == 'base'
    assert all(future.done() for future in futures)
    # The two futures are created by one line of code.
    assert sorted((line.lookups, line.failed) for line in buffer.audit.lines()) == [(1, 0), (2, 0)]


def test_without_an_audit_a_buffer_has_nothing_of_it():
    buffer = filled()
    assert buffer.audit is None
    assert len(buffer.observers) == 0
