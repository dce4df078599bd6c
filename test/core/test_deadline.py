# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import math
import threading

import pytest
from tf_tree_py.core.buffer.waiting import WallDeadline


def test_wait_ends_when_the_event_is_set():
    event = threading.Event()
    threading.Timer(0.01, event.set).start()
    assert WallDeadline(30.0).wait(event)


def test_wait_ends_when_time_is_up():
    deadline = WallDeadline(0.02)
    assert not deadline.wait(threading.Event())
    assert 0.02 <= deadline.elapsed_s() < 10.0


class Asked(threading.Event):
    """An event that records the timeouts of its waits."""

    def __init__(self):
        super().__init__()
        self.timeouts = []

    def wait(self, timeout=None):
        self.timeouts.append(timeout)
        return super().wait(timeout)


def test_second_wait_has_only_the_time_that_is_left():
    event, deadline = Asked(), WallDeadline(0.02)
    assert not deadline.wait(event) and not deadline.wait(event)
    first, second = event.timeouts
    assert 0.0 < first <= 0.02
    assert second == 0.0


@pytest.mark.parametrize('timeout_s', [0.0, -1.0])
def test_without_time_only_what_is_there_counts(timeout_s):
    event = threading.Event()
    assert not WallDeadline(timeout_s).wait(event)
    event.set()
    assert WallDeadline(timeout_s).wait(event)


def test_for_ever_is_a_timeout_too():
    event = threading.Event()
    threading.Timer(0.01, event.set).start()
    assert WallDeadline(math.inf).wait(event)
