# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Edges whose stamps go by any clock, and quantiles by sorting."""

import numpy as np
from tf_tree_py.health.measures.sample_rows import Rows, Steps
from tf_tree_py.health.measures.timing import Timing

MS, SECOND = 10**6, 10**9
BEGIN = 1000 * SECOND


def timing_of(received, stamps):
    """Return the measures of an edge, from (N,) nanoseconds."""
    poses = np.zeros((7, len(stamps)))
    poses[6] = 1.0
    rows = Rows(np.array(received, np.int64), np.array(stamps, np.int64), poses)
    timing = Timing()
    timing.add(rows)
    if len(rows) > 4:
        timing.add_steps(Steps(rows))
    return timing


def edge_at(seconds, *, lead=0.0, pace=1.0, delay=0.01):
    """Return the measures of an edge; the seconds are those of its samples, by the arrivals."""
    seconds = np.asarray(seconds, float)
    return timing_of(BEGIN + np.round(seconds * 1e9),
                     BEGIN + np.round((seconds * pace + lead - delay) * 1e9))


def at(numbers, part):
    ordered = sorted(numbers)
    return ordered[round(part * (len(ordered) - 1))] if ordered else 0.0


def mid(numbers):
    return at(numbers, 0.5)
