# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The content of a page: all frames at one stamp, and those that were left behind."""

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.view.model.moment import (
    left_behind_by_stamps,
    live_moment,
    moment_at,
    Remembered,
    window,
)

SECOND = 1_000_000_000


def moving(buffer, parent, child, begin, end, step=SECOND // 50, y=0.0):
    """Insert an edge that moves along x at 1 m/s."""
    for stamp in range(begin, end + 1, step):
        buffer.insert(parent, child, stamp, Pose(x=stamp / SECOND, y=y), strict=False)


@pytest.fixture
def robot():
    buffer = BufferCore(UNLIMITED)
    moving(buffer, 'map', 'base', 10 * SECOND, 20 * SECOND)
    moving(buffer, 'base', 'arm', 10 * SECOND, 20 * SECOND, y=1.0)
    buffer.insert('arm', 'hand', 0, Pose(z=1.0), static=True)
    return buffer


def pose_of(moment, frame):
    return moment.poses[moment.place(frame)]


def test_every_pose_is_the_tree_at_the_one_stamp(robot):
    moment = moment_at(robot, 'map', 15 * SECOND + 1)
    tree = robot.lookup_tree('map', 15 * SECOND + 1)
    assert moment.frames == tuple(tree)
    np.testing.assert_array_equal(moment.poses, list(tree.values()))
    assert set(moment.stamps) == {15 * SECOND + 1}
    assert not moment.stale.any()


def test_lines_lead_to_parents(robot):
    moment = moment_at(robot, 'arm', 15 * SECOND)
    parents = {frame: None if place < 0 else moment.frames[place]
               for frame, place in zip(moment.frames, moment.parents.tolist(), strict=True)}
    assert parents == {'map': None, 'base': 'map', 'arm': 'base', 'hand': 'arm'}
    assert moment.static[moment.place('hand')] and not moment.static[moment.place('arm')]


def test_live_moment_is_the_newest_of_all_that_go_on(robot):
    robot.insert('map', 'base', 20 * SECOND + SECOND // 25, Pose())
    assert live_moment(robot, 'map', 20 * SECOND).stamp == 20 * SECOND


def test_frame_that_stops_is_left_where_it_was_and_goes_stale(robot):
    moving(robot, 'map', 'base', 20 * SECOND, 22 * SECOND)
    moment = live_moment(robot, 'map', 22 * SECOND)
    assert moment.stamp == 22 * SECOND
    assert dict(zip(moment.frames, moment.stale.tolist(), strict=True)) == {
        'map': False, 'base': False, 'arm': True, 'hand': True}
    for frame in ('arm', 'hand'):
        assert moment.stamps[moment.place(frame)] == 20 * SECOND
        assert moment.ages[moment.place(frame)] == 2 * SECOND
        np.testing.assert_array_equal(
            pose_of(moment, frame), robot.lookup('map', frame, 20 * SECOND))


def test_edge_that_is_late_is_waited_for_and_one_that_is_silent_is_not():
    """Stamps alone do not distinguish the two; an observer of the arrivals does."""
    now, late = 20 * SECOND, 3 * SECOND
    buffer, doctor = BufferCore(now=lambda: now), Doctor()
    buffer.observers.add(doctor)

    def send(child, end, late=0):
        nonlocal now
        for now in range(10 * SECOND, end, SECOND // 10):
            buffer.insert('map', child, now - late, Pose())

    for child, end in (('gone', 15 * SECOND), ('base', 20 * SECOND)):
        send(child, end)
    send('camera', 20 * SECOND, late)
    moment = live_moment(buffer, 'map', now, doctor.left_behind)
    assert moment.stamp == now - late
    assert dict(zip(moment.frames, moment.stale.tolist(), strict=True)) == {
        'map': False, 'gone': True, 'base': False, 'camera': False}
    moment = live_moment(buffer, 'map', now, None)
    assert moment.stale[moment.place('camera')]
    now += 10 * SECOND
    moment = live_moment(buffer, 'map', now, doctor.left_behind)
    assert moment.stamp == now - 10 * SECOND - late
    assert {frame for frame, stale in zip(moment.frames, moment.stale, strict=True)
            if not stale} == {'map'}


def test_what_is_left_behind_is_found_out_once_in_a_while():
    asked = []
    remembered = Remembered(lambda now: asked.append(now) or {('map', 'base')})
    for now in (1, 2, 0, 3, 0):
        assert remembered(now) == {('map', 'base')}
    assert asked == [1, 0]


def test_all_go_stale_when_nothing_comes_any_more_but_what_never_moves(robot):
    robot.insert('map', 'floor', 0, Pose(), static=True)
    moment = live_moment(robot, 'map', 25 * SECOND)
    assert moment.stamp == 20 * SECOND
    assert {frame for frame, stale in zip(moment.frames, moment.stale, strict=True)
            if not stale} == {'map', 'floor'}


def test_edge_that_comes_slowly_is_not_stale_between_its_samples(robot):
    moving(robot, 'world', 'map', 10 * SECOND, 20 * SECOND, step=2 * SECOND)
    moving(robot, 'map', 'base', 20 * SECOND, 21 * SECOND)
    moving(robot, 'base', 'arm', 20 * SECOND, 21 * SECOND)
    moment = live_moment(robot, 'world', 21 * SECOND + SECOND // 2)
    assert moment.stamp == 20 * SECOND
    assert not moment.stale.any()


def test_another_tree_does_not_hold_the_page_up(robot):
    moving(robot, 'elsewhere', 'thing', 10 * SECOND, 20 * SECOND - SECOND // 25)
    moment = live_moment(robot, 'map', 20 * SECOND)
    assert moment.stamp == 20 * SECOND
    assert 'thing' not in moment.frames


def test_frame_hangs_where_it_hung_then(robot):
    moving(robot, 'map', 'arm', 21 * SECOND, 22 * SECOND)
    moving(robot, 'map', 'base', 20 * SECOND, 22 * SECOND)
    for stamp, parent in ((15 * SECOND, 'base'), (22 * SECOND, 'map')):
        moment = moment_at(robot, 'map', stamp)
        assert moment.frames[moment.parents[moment.place('arm')]] == parent


@pytest.mark.parametrize('frame', ['nobody', '', '/map'])
def test_fixed_frame_that_is_not_there_shows_nothing(robot, frame):
    assert moment_at(robot, frame, 15 * SECOND).frames == ()
    assert live_moment(robot, frame, 15 * SECOND).frames == ()


def test_empty_and_static_trees_can_be_looked_at():
    buffer = BufferCore()
    assert live_moment(buffer, 'map', SECOND).frames == ()
    buffer.insert('map', 'base', 0, Pose(x=1.0), static=True)
    moment = live_moment(buffer, 'map', SECOND)
    assert moment.frames == ('map', 'base') and not moment.stale.any()


def test_window_is_no_longer_than_what_is_kept():
    buffer = BufferCore(10 * SECOND)
    moving(buffer, 'map', 'gone', 0, SECOND)
    moving(buffer, 'map', 'base', 100 * SECOND, 105 * SECOND)
    assert window(buffer.edges(), buffer.cache_time) == (95 * SECOND, 105 * SECOND)
    assert left_behind_by_stamps(buffer.edges())(0) == {('map', 'gone')}


@examples(2)
@given(st.data())
def test_no_pose_is_a_mix_of_stamps(data):
    """Whatever the edges' stamps: each pose is a lookup at the one stamp that is displayed."""
    count = data.draw(st.integers(2, 8))
    buffer = BufferCore(UNLIMITED)
    for number in range(1, count):
        parent = f'f{data.draw(st.integers(0, number - 1))}'
        stamps = data.draw(st.lists(st.integers(1, 40), max_size=6))
        for stamp in stamps or [1]:
            buffer.insert(parent, f'f{number}', stamp * SECOND // 10, Pose(x=float(stamp)),
                          static=not stamps, strict=False)
    fixed = f'f{data.draw(st.integers(0, count - 1))}'
    stamp = data.draw(st.integers(1, 45)) * SECOND // 10
    for moment in (moment_at(buffer, fixed, stamp), live_moment(buffer, fixed, stamp)):
        assert set(buffer.lookup_tree(fixed, moment.stamp)) <= set(moment.frames)
        for frame, own, pose in zip(moment.frames, moment.stamps.tolist(), moment.poses,
                                    strict=True):
            assert own <= moment.stamp
            np.testing.assert_allclose(buffer.lookup(fixed, frame, own), pose, atol=1e-12)
