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
