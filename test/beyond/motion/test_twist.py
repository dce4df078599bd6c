# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Velocities of frames, compared with motions of known velocity."""

import itertools
import math

from inputs import for_each
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
from strategies import random_pose
from tf_tree_py import BufferCore
from tf_tree_py.beyond.motion.twist import lookup_twist, lookup_twist_many, Velocity
from tf_tree_py.core import (
    ExtrapolationException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LATEST,
    LookupException,
    Pose,
)
from tf_tree_py.core.geometry import se3, so3
from tf_tree_py.core.tree.queries import Queries
from tf_tree_py.screws import carry

# --- known motions


def test_twist_from_before_a_frame_was_hung_elsewhere():
    """The two are no longer connected; they are looked up at a time, such as 0, when they were."""
    buffer = BufferCore()
    for stamp in range(-SECOND, SECOND + 1, SECOND // 10):
        buffer.insert('map', 'base', stamp, Pose(stamp / SECOND))
    buffer.insert('lift', 'base', 2 * SECOND, Pose())
    for stamp in (0, SECOND // 2):
        twists = lookup_twist_many(buffer, 'base', 'map', [stamp], SECOND // 10)
        assert twists == pytest.approx(np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]), abs=1e-9)
    assert lookup_twist_many(buffer, 'base', 'map', [], SECOND).shape == (0, 6)
    assert lookup_twist(buffer, 'base', 'map', SECOND // 2, SECOND // 10).linear == pytest.approx(
        (1.0, 0.0, 0.0), abs=1e-9)


def test_spinning_in_place_has_no_linear_velocity():
    buffer = moving(screw_motion(Pose(x=3.0), (0, 0, 0, 0, 0, 2.0)))
    velocity = lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL)
    assert velocity.stamp == MIDDLE
    assert velocity.linear == pytest.approx((0, 0, 0), abs=1e-12)
    assert velocity.angular == pytest.approx((0, 0, 2.0), abs=1e-12)


def test_a_yawed_frame_that_moves_along_world_x_moves_along_world_x():
    buffer = moving(lambda time_s: Pose.from_xyz_rpy(x=1.5 * time_s, yaw=math.pi / 2))
    velocity = lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL)
    assert velocity.linear == pytest.approx((1.5, 0, 0), abs=1e-12)
    assert velocity.angular == pytest.approx((0, 0, 0), abs=1e-12)
    in_own_axes = lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL, reference_frame='body')
    assert in_own_axes.linear == pytest.approx((0, -1.5, 0), abs=1e-12)


@for_each(stamp=[START, START + 3 * PERIOD, MIDDLE, END - PERIOD, END, LATEST],
          interval=[2 * PERIOD, INTERVAL, SECOND])
def test_driving_a_circle(stamp, interval):
    speed, turn = 2.0, 1.5
    buffer = moving(screw_motion(Pose(x=4.0, y=-1.0), (speed, 0, 0, 0, 0, turn)))
    velocity = lookup_twist(buffer, 'body', 'world', stamp, interval)
    yaw = turn * ((stamp or END) - START) / SECOND
    assert velocity.linear == pytest.approx(
        (speed * math.cos(yaw), speed * math.sin(yaw), 0), abs=1e-10)
    assert velocity.angular == pytest.approx((0, 0, turn), abs=1e-10)


def test_a_helix():
    radius, turn, climb = 2.0, 3.0, 0.4
    buffer = moving(lambda time_s: Pose.from_xyz_rpy(
        radius * math.cos(turn * time_s), radius * math.sin(turn * time_s), climb * time_s,
        yaw=turn * time_s))
    for step in range(20, 180, 7):
        angle = turn * step * PERIOD / SECOND
        velocity = lookup_twist(buffer, 'body', 'world', START + step * PERIOD, 4 * PERIOD)
        assert velocity.linear == pytest.approx(
            (-radius * turn * math.sin(angle), radius * turn * math.cos(angle), climb), abs=1e-10)
        assert velocity.angular == pytest.approx((0, 0, turn), abs=1e-10)


@pytest.mark.parametrize('seed', range(5))
def test_each_edge_adds_its_own_screw_exactly(seed):
    rng = np.random.default_rng(seed)
    frames = ['a', 'b', 'c', 'd']
    offsets = [random_pose(rng, 3.0) for _ in frames[1:]]
    own = [tuple(rng.uniform(-4.0, 4.0, 6)) for _ in frames[1:]]
    motions = [screw_motion(pose, twist) for pose, twist in zip(offsets, own, strict=True)]
    buffer = buffer_of(*[(parent, child, motion) for (parent, child), motion
                         in zip(itertools.pairwise(frames), motions, strict=True)])
    expected = np.zeros(6)
    a_T_d = Pose()
    for pose, twist in zip([motion(1.0) for motion in motions], own, strict=True):
        expected = np.array(carry(se3.inverse(pose), tuple(expected))) + twist
        a_T_d = a_T_d @ Pose(*pose)
    expected = [*so3.rotate(a_T_d.rotation, expected[:3]),
                *so3.rotate(a_T_d.rotation, expected[3:])]
    for interval in (2 * PERIOD, INTERVAL, 30 * PERIOD):
        down = lookup_twist(buffer, 'd', 'a', MIDDLE, interval)
        assert flat(down) == pytest.approx(expected, abs=1e-9)
        # The motion of a seen from d, in d's axes: the negative, moved to a's origin.
        up = lookup_twist(buffer, 'a', 'd', MIDDLE, interval)
        a_T_d_at_its_own = (0.0, 0.0, 0.0, *a_T_d.rotation)
        in_d = carry(se3.inverse(a_T_d_at_its_own), tuple(expected))
        d_T_a = a_T_d.inverse()
        at_a = np.subtract(0.0, carry((*np.negative(d_T_a.translation), 0, 0, 0, 1), in_d))
        assert flat(up) == pytest.approx(at_a, abs=1e-9)


def difference_quotient(pose_at, time_s, step_s=1e-5):
    """Return the velocity of a pose in its parent's axes, numerically."""
    before, after = pose_at(time_s - step_s), pose_at(time_s + step_s)
    linear = (np.array(after[:3]) - before[:3]) / (2 * step_s)
    turn = so3.log(so3.multiply(after[3:], so3.conjugate(before[3:])))
    return [*linear, *(np.array(turn) / (2 * step_s))]


@pytest.mark.parametrize('seed', range(4))
def test_the_error_vanishes_with_the_square_of_the_interval(seed):
    first, second, third = wobble(seed), wobble(seed + 10), wobble(seed + 20)

    def one_T_two(time_s):
        base_T_one, base_T_two = first(time_s), se3.compose(second(time_s), third(time_s))
        return se3.compose(se3.inverse(base_T_one), base_T_two)

    buffer = buffer_of(('base', 'one', first), ('base', 'mid', second), ('mid', 'two', third))
    truth = difference_quotient(one_T_two, 1.0)
    errors = [np.abs(np.subtract(
        flat(lookup_twist(buffer, 'two', 'one', MIDDLE, interval)), truth)).max()
        for interval in (16 * PERIOD, 8 * PERIOD, 4 * PERIOD, 2 * PERIOD)]
    assert errors[-1] < 1e-3
    for coarse, fine in itertools.pairwise(errors):
        assert fine < 0.3 * coarse


# --- reference frame and point


def test_reference_point_takes_the_lever_into_account():
    buffer = buffer_of(('world', 'body', screw_motion(Pose(x=3.0), (1.0, 0, 0, 0, 0, 2.0))),
                       ('world', 'other', wobble(3)))
    buffer.insert('body', 'tip', 0, Pose(x=0.5, y=0.1), static=True)
    plain = lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL)
    tip = buffer.lookup('world', 'tip', MIDDLE).translation
    body = buffer.lookup('world', 'body', MIDDLE).translation
    lever = np.subtract(tip, body)
    expected = np.array(plain.linear) + np.cross(plain.angular, lever)
    for options in ({'reference_point': (0.5, 0.1, 0.0)}, {'reference_point_frame': 'tip'},
                    {'reference_point_frame': 'world', 'reference_point': tip}):
        at_point = lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL, **options)
        assert at_point.linear == pytest.approx(expected, abs=1e-10)
        assert at_point.angular == pytest.approx(plain.angular, abs=1e-10)
    assert lookup_twist(buffer, 'tip', 'world', MIDDLE, INTERVAL).linear == pytest.approx(
        expected, abs=1e-10)
    turned = lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL, reference_frame='other',
                          reference_point_frame='tip')
    back = buffer.lookup('world', 'other', MIDDLE).rotation
    assert so3.rotate(back, turned.linear) == pytest.approx(expected, abs=1e-10)


def test_seen_from_a_turning_frame_what_stands_still_moves():
    buffer = moving(screw_motion(Pose(), (0, 0, 0, 0, 0, 2.0)))
    buffer.insert('world', 'tree', 0, Pose(x=5.0), static=True)
    velocity = lookup_twist(buffer, 'tree', 'body', MIDDLE, INTERVAL)
    body_p_tree = buffer.lookup('body', 'tree', MIDDLE).translation
    assert velocity.linear == pytest.approx(np.cross((0, 0, -2.0), body_p_tree), abs=1e-10)
    assert velocity.angular == pytest.approx((0, 0, -2.0), abs=1e-10)


# --- many


@pytest.mark.parametrize(('tracking', 'observation', 'options'), [
    ('two', 'one', {}),
    ('one', 'two', {'reference_frame': 'base'}),
    ('two', 'base', {'reference_frame': 'two', 'reference_point': (1.0, 2.0, 3.0)}),
    ('mid', 'two', {'reference_point': (1.0, 2.0, 3.0), 'reference_point_frame': 'base'}),
    ('fixed', 'base', {}), ('two', 'two', {}),
])
def test_many_twists_are_answered_as_one_by_one(tracking, observation, options):
    buffer = buffer_of(('base', 'one', wobble(1)), ('base', 'mid', wobble(2)),
                       ('mid', 'two', wobble(3)))
    buffer.insert('base', 'fixed', 0, Pose(x=1.0), static=True)
    stamps = np.random.default_rng(2).integers(START, END, 60)
    stamps[:4] = START, END, START + 1, END - 1
    twists = lookup_twist_many(buffer, tracking, observation, stamps, INTERVAL, **options)
    expected = [flat(lookup_twist(buffer, tracking, observation, stamp, INTERVAL, **options))
                for stamp in stamps.tolist()]
    assert twists.shape == (60, 6)
    assert twists == pytest.approx(np.array(expected), abs=1e-9)


def test_no_stamps_give_no_twists():
    buffer = moving(wobble(1))
    empty = np.zeros(0, dtype=int)
    assert lookup_twist_many(buffer, 'body', 'world', empty, INTERVAL).shape == (0, 6)


def test_stamps_outside_are_counted():
    stamps = [MIDDLE, END + 1, MIDDLE, END + 2]
    with pytest.raises(FutureExtrapolationException, match='2 of 4 stamps have no answer'):
        lookup_twist_many(moving(wobble(1)), 'body', 'world', stamps, INTERVAL)


# --- the ends of the data, and errors


@pytest.mark.parametrize('interval', [PERIOD, 10 * SECOND])
def test_interval_is_kept_inside_the_data(interval):
    buffer = moving(screw_motion(Pose(), (1.0, 0.2, 0, 0.3, 0, 1.0)))
    for stamp in (START, END, LATEST):
        velocity = lookup_twist(buffer, 'body', 'world', stamp, interval, reference_frame='body')
        assert flat(velocity) == pytest.approx((1.0, 0.2, 0, 0.3, 0, 1.0), abs=1e-9)
        assert velocity.stamp == (stamp or END)


def test_interval_lies_around_the_stamp():
    buffer = BufferCore()
    for step, x in enumerate([0.0, 1.0, 3.0, 7.0, 8.0]):
        buffer.insert('world', 'body', START + step * SECOND, Pose(x=x))

    def speed(step, interval_s):
        stamp = START + round(step * SECOND)
        return lookup_twist(buffer, 'body', 'world', stamp, interval_s * SECOND).linear[0]

    assert speed(2, 2) == pytest.approx(3.0)
    assert speed(2.5, 1) == pytest.approx(4.0)
    assert speed(0, 2) == pytest.approx(1.5)
    assert speed(4, 2) == pytest.approx(2.5)


def test_what_does_not_move_has_no_twist():
    buffer = BufferCore()
    buffer.insert('world', 'body', 0, Pose(x=1.0), static=True)
    assert lookup_twist(buffer, 'body', 'world', 5, INTERVAL) == Velocity(5, (0, 0, 0), (0, 0, 0))
    assert flat(lookup_twist(buffer, 'body', 'body', LATEST, INTERVAL)) == (0,) * 6


def test_one_sample_tells_no_velocity_yet():
    buffer = BufferCore()
    buffer.insert('world', 'body', START, Pose(x=1.0))
    with pytest.raises(ExtrapolationException, match='two samples.*world -> body') as caught:
        lookup_twist(buffer, 'body', 'world', LATEST, INTERVAL)
    assert caught.value.blocked_on == (('body', START + 1),)


@pytest.mark.parametrize('interval', [0, -1, 0.1, None, '1'])
def test_interval_is_a_positive_number_of_nanoseconds(interval):
    buffer = moving(wobble(1))
    for lookup, when in ((lookup_twist, MIDDLE), (lookup_twist_many, [MIDDLE])):
        with pytest.raises(InvalidArgumentException, match='Invalid argument'):
            lookup(buffer, 'body', 'world', when, interval)


def test_unknown_frames_and_stamps_outside_are_refused():
    buffer = moving(wobble(1))
    with pytest.raises(LookupException, match='"ghost"'):
        lookup_twist(buffer, 'ghost', 'world', MIDDLE, INTERVAL)
    with pytest.raises(LookupException, match='"ghost"'):
        lookup_twist(buffer, 'body', 'world', MIDDLE, INTERVAL, reference_frame='ghost')
    with pytest.raises(FutureExtrapolationException):
        lookup_twist(buffer, 'body', 'world', END + 1, INTERVAL)


def test_a_frame_that_changed_its_parent_goes_on_moving():
    motion = screw_motion(Pose(x=1.0), (1.0, 0, 0, 0, 0, 1.0))
    buffer = buffer_of(('world', 'car', wobble(4)))
    for stamp in range(START, END + 1, PERIOD):
        pose = Pose(*motion((stamp - START) / SECOND))
        if stamp > MIDDLE:
            pose = buffer.lookup('car', 'world', stamp) @ pose
        buffer.insert('world' if stamp <= MIDDLE else 'car', 'body', stamp, pose)
    for stamp in (MIDDLE - 50 * PERIOD, MIDDLE - 5 * PERIOD, MIDDLE + 50 * PERIOD):
        velocity = lookup_twist(buffer, 'body', 'world', stamp, 2 * PERIOD, reference_frame='body')
        assert flat(velocity) == pytest.approx((1.0, 0, 0, 0, 0, 1.0), abs=1e-3)


def test_buffer_is_asked_without_naming_its_publishers():
    class Reluctant(BufferCore):

        def edges(self):
            raise AssertionError('a ROS buffer would ask the graph')

    buffer = Reluctant()
    for stamp in (START, END):
        buffer.insert('world', 'body', stamp, Pose(x=stamp / SECOND))
    assert lookup_twist(buffer, 'body', 'world', MIDDLE, SECOND).linear[0] == pytest.approx(1.0)
    assert Queries.edges(buffer)


def test_frame_that_was_hung_elsewhere_has_the_velocity_that_it_had_then():
    """A box on a belt at 1 m/s, then in a gripper at 2 m/s; the belt's edge is reversed."""
    buffer = BufferCore(100 * SECOND)
    for tenth in range(21):
        stamp = tenth * SECOND // 10
        buffer.insert('belt', 'box', stamp, Pose(x=tenth / 10))
        buffer.insert('world', 'belt', stamp, Pose())
    for tenth in range(40, 61):
        stamp = tenth * SECOND // 10
        buffer.insert('gripper', 'box', stamp, Pose(x=tenth / 5))
        buffer.insert('world', 'gripper', stamp, Pose())
        buffer.insert('belt', 'world', stamp, Pose())
    stamps = [SECOND // 50, SECOND, 2 * SECOND, 5 * SECOND]
    expected = [1.0, 1.0, 1.0, 2.0]
    for observer in ('world', 'belt'):
        found = [lookup_twist(buffer, 'box', observer, stamp, SECOND // 10).linear[0]
                 for stamp in stamps]
        assert found == pytest.approx(expected)
        many = lookup_twist_many(buffer, 'box', observer, stamps, SECOND // 10)
        assert many[:, 0] == pytest.approx(expected)
