# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Buffers of frames with known motion, for 2 s."""

import numpy as np
from tf_tree_py import BufferCore, screws
from tf_tree_py.core.geometry import se3

SECOND = 1_000_000_000
START, END, PERIOD = 10 * SECOND, 12 * SECOND, SECOND // 100
MIDDLE, INTERVAL = 11 * SECOND, SECOND // 10


def screw_motion(pose, twist):
    """Return the motion from a pose at START with a constant twist in the frame's own axes."""
    return lambda time_s: se3.compose(pose, screws.exp(tuple(time_s * value for value in twist)))


def buffer_of(*edges):
    """Return a buffer of edges (parent, child, motion over seconds since START)."""
    buffer = BufferCore()
    for parent, child, motion in edges:
        for stamp in range(START, END + 1, PERIOD):
            buffer.insert(parent, child, stamp, motion((stamp - START) / SECOND))
    return buffer


def moving(motion):
    return buffer_of(('world', 'body', motion))


def flat(velocity):
    return (*velocity.linear, *velocity.angular)


def wobble(seed):
    """Return a smooth motion that is not a screw motion."""
    rng = np.random.default_rng(seed)
    phases, sizes, rates = rng.uniform(0, 6, 6), rng.uniform(0.3, 1.0, 6), rng.uniform(0.5, 2, 6)

    def motion(time_s):
        values = sizes * np.sin(rates * time_s + phases)
        return screws.exp(tuple(values.tolist()))

    return motion
