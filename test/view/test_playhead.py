# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The time of a page: live, paused, playing, and the times to which it can go."""

import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.view.model.playhead import Playhead

SECOND = 1_000_000_000


def feed(buffer, begin_s, end_s):
    for tenth in range(10 * begin_s, 10 * end_s + 1):
        buffer.insert('map', 'base', tenth * SECOND // 10, Pose(x=tenth / 10), strict=False)
        if tenth % 10 == 0:
            buffer.insert('map', 'slow', tenth * SECOND // 10, Pose(), strict=False)


@pytest.fixture
def buffer():
    buffer = BufferCore(10 * SECOND)
    feed(buffer, 10, 20)
    return buffer


@pytest.fixture
def playhead(buffer):
    return Playhead(buffer, live=True)


def stamp_of(playhead):
    return playhead.moment('map', playhead.stamp).stamp


def test_live_follows_the_newest(buffer, playhead):
    assert stamp_of(playhead) == 20 * SECOND
    feed(buffer, 20, 21)
    assert stamp_of(playhead) == 21 * SECOND


def test_paused_page_keeps_what_the_buffer_forgets(buffer, playhead):
    playhead.seek(11 * SECOND)
    feed(buffer, 21, 60)
    moment = playhead.moment('map', 60 * SECOND)
    assert moment.stamp == 11 * SECOND
    assert moment.poses[moment.place('base'), 0] == pytest.approx(11.0)
    assert playhead.window() == (10 * SECOND, 20 * SECOND)
    playhead.go_live()
    assert stamp_of(playhead) == 60 * SECOND


def test_seeking_stays_in_the_window(playhead):
    playhead.seek(0)
    assert stamp_of(playhead) == 10 * SECOND
    playhead.seek(99 * SECOND)
    assert stamp_of(playhead) == 20 * SECOND


@pytest.mark.parametrize('speed', [0.1, 1.0, 10.0])
def test_playing_goes_at_its_speed_and_ends_at_the_end(playhead, speed):
    playhead.seek(12 * SECOND)
    playhead.speed = speed
    playhead.play()
    playhead.advance(0.5)
    assert stamp_of(playhead) == round((12.0 + 0.5 * speed) * SECOND)
    playhead.advance(1000.0)
    assert stamp_of(playhead) == 20 * SECOND
    assert not playhead.playing and not playhead.live


def test_playing_at_the_end_begins_anew(playhead):
    playhead.play()
    assert stamp_of(playhead) == 10 * SECOND


def test_time_passes_only_while_it_plays(playhead):
    playhead.seek(12 * SECOND)
    playhead.advance(1.0)
    assert stamp_of(playhead) == 12 * SECOND


@pytest.mark.parametrize(('frame', 'count', 'expected'), [
    (None, 1, 15.1), (None, -1, 15.0), (None, -2, 14.9), (None, 3, 15.3),
    ('slow', 1, 16.0), ('slow', -1, 15.0), ('slow', 99, 20.0), ('slow', -99, 10.0),
    ('map', 1, 15.1),
])
def test_steps_go_from_sample_to_sample(playhead, frame, count, expected):
    playhead.seek(round(15.05 * SECOND))
    playhead.step(frame, count)
    assert stamp_of(playhead) == round(expected * SECOND)


def test_step_leaves_the_sample_that_it_is_on(playhead):
    playhead.seek(15 * SECOND)
    playhead.step('base', 1)
    assert stamp_of(playhead) == round(15.1 * SECOND)
    playhead.step('base', -1)
    assert stamp_of(playhead) == 15 * SECOND


def test_recording_begins_at_its_beginning_and_has_no_live(buffer):
    playhead = Playhead(buffer.snapshot(), live=False)
    assert stamp_of(playhead) == 10 * SECOND
    playhead.go_live()
    assert not playhead.live


def test_recording_may_begin_at_zero():
    buffer = BufferCore()
    feed(buffer, 0, 5)
    playhead = Playhead(buffer, live=False)
    assert playhead.moment('map', 0).poses[1, 0] == pytest.approx(0.0, abs=1e-6)


def test_nothing_to_go_to_is_no_error():
    playhead = Playhead(BufferCore(), live=True)
    playhead.step(None, 1)
    playhead.play()
    playhead.advance(1.0)
    assert playhead.moment('map', 0).frames == ()
