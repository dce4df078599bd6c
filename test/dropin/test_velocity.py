# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Velocities as tf2 computes them, compared with its own arithmetic and with recordings."""

import math

from motions import (
    buffer_of,
    END,
    flat,
    INTERVAL,
    MIDDLE,
    moving,
    PERIOD,
    screw_motion,
    SECOND,
    START,
    wobble,
)
import numpy as np
import pytest
from standin import run_with_tf2
from tf_tree_py import BufferCore
from tf_tree_py.core import LookupException, Pose
from tf_tree_py.dropin.buffer import lookup_velocity


def as_tf2_computes_it(buffer, tracking, observation, reference, point, point_frame, stamp,
                       interval):
    """Return lookupVelocity in matrices, step by step as the C++ does it."""
    def as_seconds(nanoseconds):
        return nanoseconds // SECOND + 1e-9 * (nanoseconds % SECOND)

    def as_nanoseconds(seconds):
        return int(seconds) * SECOND + round((seconds - int(seconds)) * 1e9)

    def matrix(target, source, seconds):
        return buffer.lookup(target, source, as_nanoseconds(seconds)).as_matrix()

    time_s, interval_s = as_seconds(stamp), interval / 1e9
    latest_s = as_seconds(buffer.latest_common_time(observation, tracking))
    end_s = min(time_s + interval_s * 0.5, latest_s)
    start_s = max(1e-5 + interval_s, end_s) - interval_s
    start, end = matrix(observation, tracking, start_s), matrix(observation, tracking, end_s)
    turn = start[:3, :3].T @ end[:3, :3]
    angle = math.acos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0))
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    axis /= max(np.linalg.norm(axis), 1e-300)
    rotating = start[:3, :3] @ axis * angle / (end_s - start_s)
    going = (end[:3, 3] - start[:3, 3]) / (end_s - start_s)
    inverse = matrix(reference, tracking, time_s)
    out_rotating = inverse[:3, :3] @ rotating
    out_going = inverse[:3, :3] @ going + np.cross(inverse[:3, 3], out_rotating)
    desired = (matrix(reference, point_frame, time_s) @ [*point, 1.0])[:3]
    out_going = out_going + out_rotating * (desired - inverse[:3, 3])
    return [*out_going, *out_rotating], as_nanoseconds(start_s + interval_s * 0.5)


@pytest.mark.parametrize('stamp', [MIDDLE, START + INTERVAL, END - PERIOD, END])
@pytest.mark.parametrize('full', [
    ('base', (0.0, 0.0, 0.0), 'two'), ('one', (1.0, -2.0, 3.0), 'mid'),
    ('two', (0.5, 0.0, 0.0), 'two'),
])
def test_velocity_is_as_tf2_computes_it(stamp, full):
    buffer = buffer_of(('base', 'one', wobble(1)), ('base', 'mid', wobble(2)),
                       ('mid', 'two', wobble(3)))
    reference, point, point_frame = full
    velocity = lookup_velocity(
        buffer, 'two', 'base', stamp, INTERVAL, reference_frame=reference,
        reference_point=point, reference_point_frame=point_frame)
    expected, expected_stamp = as_tf2_computes_it(
        buffer, 'two', 'base', reference, point, point_frame, stamp, INTERVAL)
    assert flat(velocity) == pytest.approx(expected, abs=1e-9)
    assert velocity.stamp == expected_stamp


@pytest.mark.parametrize(('after', 'interval', 'recorded'), [
    (20_000_000, 20_000_000, (28.630782055861136, -18.844497202086238, 0, 0, 0,
                              39.99982664680735)),
    (17_654_321, 12_345_678, (27.94323163353905, -19.138162902565927, 0, 0, 0,
                              36.20007620071224)),
    (40_000_000, 5_000_000, (-38.051787539646575, -41.445449240591046, 0, 0, 0,
                             69.99999382728971)),
    (40_000_000, 30_000_001, (-21.467847885696656, -29.436974433879826, 0, 0, 0,
                              49.9998160168737)),
])
def test_velocity_at_todays_stamps_is_what_jazzy_was_recorded_to_give(after, interval, recorded):
    # Seconds since 1970 as floats are 200 ns apart, so tf2's rounding is visible.
    buffer, begin = BufferCore(), 1_700_000_000_123_456_789
    for step in range(5):
        buffer.insert('world', 'body', begin + step * PERIOD, Pose.from_xyz_rpy(
            x=0.1 * step * step, y=-0.2 * step, yaw=0.1 * step * step))
    velocity = lookup_velocity(buffer, 'body', 'world', begin + after, interval)
    assert flat(velocity) == pytest.approx(recorded, abs=1e-10)


def test_velocity_has_the_faults_of_tf2():
    spinning = moving(screw_motion(Pose(x=3.0), (0, 0, 0, 0, 0, 2.0)))
    velocity = lookup_velocity(spinning, 'body', 'world', MIDDLE, INTERVAL)
    assert velocity.linear == pytest.approx((0.0, -6.0, 0.0), abs=1e-9)
    yawed = moving(lambda time_s: Pose.from_xyz_rpy(x=1.5 * time_s, yaw=math.pi / 2))
    velocity = lookup_velocity(yawed, 'body', 'world', MIDDLE, INTERVAL)
    assert velocity.linear == pytest.approx((0.0, 1.5, 0.0), abs=1e-9)


def test_velocity_of_what_is_straight_is_the_truth():
    straight = moving(lambda time_s: Pose(x=1.5 * time_s, y=-time_s))
    velocity = lookup_velocity(straight, 'body', 'world', MIDDLE, INTERVAL)
    assert flat(velocity) == pytest.approx((1.5, -1.0, 0, 0, 0, 0), abs=1e-9)
    assert velocity.stamp == pytest.approx(MIDDLE, abs=2)


def test_velocity_does_not_look_before_the_beginning_of_time():
    buffer = BufferCore()
    for microsecond in (10, 100_000):
        buffer.insert('world', 'body', microsecond * 1000, Pose(x=microsecond / 1e6))
    # The interval is cut to begin 10 us after zero; the stamp is that of the uncut one.
    velocity = lookup_velocity(buffer, 'body', 'world', SECOND // 20, SECOND)
    assert velocity.linear == pytest.approx((1.0, 0.0, 0.0))
    assert velocity.stamp == pytest.approx(SECOND // 2 + 10_000, abs=2)


def test_velocity_without_an_interval_is_not_a_number():
    velocity = lookup_velocity(moving(wobble(1)), 'body', 'world', MIDDLE, 0)
    assert all(math.isnan(value) for value in flat(velocity))


def test_velocity_refuses_unknown_frames():
    with pytest.raises(LookupException, match='"ghost"'):
        lookup_velocity(moving(wobble(1)), 'ghost', 'world', MIDDLE, INTERVAL)


@pytest.mark.parametrize(('angle', 'expected'), [
    (0.0, 0.0), (1e-9, 0.0), (1.0, 1.0), (2.0, 2.0), (-2.0, -2.0), (3.0, 3.0),
    # Beyond 120 degrees, tf2 makes the axis positive and rotates the long way round.
    (-3.0, 2.0 * math.pi - 3.0), (-2.2, 2.0 * math.pi - 2.2),
])
def test_velocity_takes_the_angle_that_tf2_takes(angle, expected):
    buffer = BufferCore()
    buffer.insert('world', 'body', START, Pose())
    buffer.insert('world', 'body', START + SECOND, Pose.from_xyz_rpy(yaw=angle))
    velocity = lookup_velocity(buffer, 'body', 'world', START + SECOND // 2, SECOND)
    rate = velocity.angular[2]
    assert rate == pytest.approx(expected, abs=1e-7)


# --- compared with the real one

def test_velocities_are_those_of_tf2():
    assert run_with_tf2("""
        import math, random
        from geometry_msgs.msg import TransformStamped
        from rclpy.duration import Duration
        from rclpy.time import Time
        import tf2_py
        from tf_tree_py import screws
        from tf_tree_py.dropin.buffer import BufferCore

        random.seed(1)
        MS = 1_000_000

        def fill(buffers, parent, child, begin):
            twist = tuple(random.uniform(-4, 4) for _ in range(6))
            for step in range(60):
                stamp = begin + 10 * step * MS + random.randrange(1000)
                message = TransformStamped(child_frame_id=child)
                message.header.frame_id = parent
                message.header.stamp = Time(nanoseconds=stamp).to_msg()
                t, r = message.transform.translation, message.transform.rotation
                t.x, t.y, t.z, r.x, r.y, r.z, r.w = screws.exp(
                    tuple(0.01 * step * value for value in twist))
                for buffer in buffers:
                    buffer.set_transform(message, 'me')

        def velocity(buffer, frames, full, *times):
            try:
                if full:
                    return buffer.lookupVelocityFullCore(
                        *frames, 'other', (1.0, 2.0, -1.0), 'arm', *times)
                return buffer.lookupVelocityCore(*frames, *times)
            except tf2_py.TransformException as error:
                return error

        answers = refusals = 0
        for begin in (0, 5000 * MS, 1_700_000_000_123 * MS + 456_789):
            buffers = tf2_py.BufferCore(), BufferCore()
            for edge in (('map', 'base'), ('base', 'arm'), ('map', 'other')):
                fill(buffers, *edge, begin)
            for _ in range(200):
                frames = random.choice([('arm', 'map'), ('arm', 'other'), ('base', 'map')])
                full = random.random() < 0.5
                times = (Time(nanoseconds=max(0, begin + random.randrange(-10 * MS, 650 * MS))),
                         Duration(nanoseconds=random.choice(
                             [2 * MS, 20 * MS, 100 * MS, 123_456_789, 300 * MS])))
                theirs, ours = (velocity(buffer, frames, full, *times) for buffer in buffers)
                if isinstance(theirs, tuple):
                    answers += 1
                    assert math.dist(sum(theirs, ()), sum(ours, ())) < 1e-9, (begin, times)
                else:
                    refusals += 1
                    assert isinstance(ours, type(theirs)), (begin, times, ours)
        print(answers > 200, refusals > 50)
    """) == 'True True\n'
