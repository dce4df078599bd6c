# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups that fail because the buffer was cleared say so, and others do not."""

import re

import pytest
from tf_tree_py import (
    BufferCore,
    ConnectivityException,
    ExtrapolationException,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    TransformException,
)

SECOND = 1_000_000_000
HERE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
WHY = 'the clock went back by 9.000 s'


@pytest.fixture
def buffer():
    """Return a buffer with map -> odom -> base -> camera from 10 to 19 s, cleared then."""
    buffer = BufferCore(now=lambda: 20 * SECOND)
    for second in range(10, 20):
        insert(buffer, 'map', 'odom', second)
        insert(buffer, 'odom', 'base', second)
    buffer.insert('base', 'camera', 0, HERE, static=True)
    buffer.start_anew(WHY)
    return buffer


def insert(buffer, parent, child, second):
    assert buffer.insert(parent, child, second * SECOND, HERE) == []


def hint_of(buffer, *frames, second=None, error=TransformException):
    with pytest.raises(error) as raised:
        buffer.lookup(*frames, 0 if second is None else second * SECOND)
    assert str(raised.value).endswith(raised.value.hint)
    return raised.value.hint


@pytest.mark.parametrize(('frames', 'second', 'error', 'hint'), [
    (('map', 'odom'), 15, NoDataException, 'The buffer had data of this edge for that time'),
    (('map', 'odom'), 3, NoDataException, 'The buffer forgot the data of this edge'),
    (('map', 'camera'), 19, NoDataException, 'The buffer had data of this edge for that time'),
    (('odom', 'base'), None, ConnectivityException, 'The buffer forgot an edge between them'),
    (('camera', 'map'), None, ConnectivityException, 'The buffer forgot an edge between them'),
])
def test_lookup_that_lacks_what_was_cleared_says_why(buffer, frames, second, error, hint):
    assert re.fullmatch(f'{hint}, and .*: {WHY}', hint_of(
        buffer, *frames, second=second, error=error))


def test_edge_that_goes_on_later_says_why_it_has_no_older_sample(buffer):
    insert(buffer, 'map', 'odom', 18)
    for second in (10, 17):
        hint = hint_of(buffer, 'map', 'odom', second=second, error=PastExtrapolationException)
        assert hint == f'The buffer had data of this edge for that time, and forgot it: {WHY}'
    assert 'No older sample of this edge has arrived' in hint_of(
        buffer, 'map', 'odom', second=9, error=PastExtrapolationException)
    # Half of the path is there again.
    assert WHY in hint_of(buffer, 'map', 'base')
    insert(buffer, 'odom', 'base', 18)
    assert buffer.lookup('map', 'camera', 18 * SECOND) == HERE
    assert WHY not in hint_of(buffer, 'map', 'base', second=20, error=ExtrapolationException)


def test_what_was_never_there_is_not_blamed_on_it(buffer):
    buffer.insert('world', 'table', 0, HERE, static=True)
    assert WHY not in hint_of(buffer, 'map', 'table', error=ConnectivityException)
    assert WHY not in hint_of(buffer, 'map', 'nowhere', error=LookupException)
    # Nor is an edge that left the window before.
    insert(buffer, 'map', 'odom', 19)
    assert WHY not in hint_of(buffer, 'map', 'odom', second=9)


def test_loop_of_old_and_new_edges_does_not_hang(buffer):
    """A frame that was above another one may be below it now."""
    insert(buffer, 'base', 'map', 20)
    assert WHY in hint_of(buffer, 'odom', 'camera')


def test_clear_by_hand_is_a_reason_too(buffer):
    insert(buffer, 'map', 'odom', 15)
    buffer.clear()
    assert hint_of(buffer, 'map', 'odom', second=15).endswith('forgot it: clear() was called')
    assert buffer.lookup('base', 'camera') == HERE


def test_each_of_many_stamps_says_why(buffer):
    insert(buffer, 'map', 'odom', 18)
    with pytest.raises(PastExtrapolationException, match=WHY):
        buffer.lookup_many('map', 'odom', [12 * SECOND, 18 * SECOND])
