# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Neighbours half a turn apart: the direction is that of tf2, whatever the sign of q."""

import itertools
import json
import math

import numpy as np
from standin import run_with_tf2
from tf_tree_py import BufferCore

SECOND = 1_000_000_000
HALF = math.sqrt(0.5)
TYPED = [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (HALF, 0, 0, HALF),
         (-HALF, 0, 0, HALF), (0, HALF, 0, HALF), (0, -HALF, 0, HALF), (0, 0, HALF, HALF),
         (0, 0, -HALF, HALF), (HALF, HALF, 0, 0), (HALF, -HALF, 0, 0), (0, HALF, 0, -HALF),
         (0.5, 0.5, 0.5, 0.5), (0.5, -0.5, 0.5, -0.5), (0.7071068, 0, 0, 0.7071068),
         (-0.7071068, 0, 0, 0.7071068), (0, 0, 0.7071068, 0.7071068)]
APART = [(a, b) for a, b in itertools.product(TYPED, TYPED) if abs(np.dot(a, b)) < 1e-9]
SIGNS = list(itertools.product((1, -1), (1, -1)))


def between(first, second):
    """Return the rotation at 0.3 between two, from single lookups and from one of many stamps."""
    buffer = BufferCore()
    for number, q in enumerate((first, second)):
        buffer.insert('map', 'base', number * SECOND, (0, 0, 0, *q), strict=False)
    stamp = 300_000_000
    return (np.array(buffer.lookup_at('map', 'base', stamp)[3:]),
            buffer.lookup_many('map', 'base', [stamp])[0, 3:])


def same(a, b):
    return abs(np.dot(a, b)) > 1.0 - 1e-9


def test_sign_of_a_quaternion_does_not_matter():
    for a, b in APART:
        first, many = between(a, b)
        assert same(first, many)
        for one, other in SIGNS[1:]:
            assert all(same(first, each) for each in between(
                one * np.array(a), other * np.array(b)))


def test_way_round_is_that_of_tf2():
    said = json.loads(run_with_tf2(f"""
        import itertools, json
        from geometry_msgs.msg import TransformStamped
        from rclpy.duration import Duration
        from rclpy.time import Time
        from tf2_py import BufferCore
        said = []
        for pair in {APART!r}:
            buffer = BufferCore(Duration(seconds=10))
            for second, q in enumerate(pair, 1):
                message = TransformStamped()
                message.header.frame_id, message.child_frame_id = 'map', 'base'
                message.header.stamp.sec = second
                r = message.transform.rotation
                r.x, r.y, r.z, r.w = map(float, q)
                buffer.set_transform(message, 'me')
            r = buffer.lookup_transform_core(
                'map', 'base', Time(nanoseconds=1_300_000_000)).transform.rotation
            said.append((r.x, r.y, r.z, r.w))
        print(json.dumps(said))
    """))
    for pair, expected in zip(APART, said, strict=True):
        assert same(between(*pair)[0], expected)
