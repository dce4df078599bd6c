# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waiting for conditions without an event, such as the ROS graph; no other helper sleeps."""

import time

from programs import PATIENCE_S


def until(condition, patience_s=PATIENCE_S):
    """Return as soon as a condition is true."""
    end = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < end, 'the condition never became true'
        time.sleep(0.002)


def repeated(action, condition, patience_s=PATIENCE_S):
    """Repeat an action that costs more than a look, until its result is as wanted; return it."""
    end = time.monotonic() + patience_s
    while True:
        result = action()
        if condition(result) or time.monotonic() > end:
            return result
        time.sleep(0.2)
