"""``Buffer(audit=True)``: the audit of tf2's own call; and nothing at all without it."""

from contextlib import suppress
import time

import pytest
from rclpy.duration import Duration
from rclpy.time import Time
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


def test_without_an_audit_a_buffer_has_nothing_of_it():
    buffer = filled()
    assert buffer.audit is None
    assert not {'lookup', 'lookup_transform'} & vars(buffer).keys()
