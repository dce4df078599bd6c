# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A frame over time: the stamps, the stamps without a result, and velocities."""

import math
import sys

from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.beyond.motion.trajectory import (
    POSE_COLUMNS,
    stamps_at_rate,
    stamps_of_slowest,
    trajectory,
    TWIST_COLUMNS,
)
from tf_tree_py.core import ExtrapolationException, InvalidArgumentException, Pose, UNLIMITED

MS = 1_000_000
SECOND = 1000 * MS
START = 1_700_000_000 * SECOND


def buffer_of(**edges):
    """Return a buffer with a chain of edges, given the stamps of each child, None if static."""
    buffer, parent = BufferCore(UNLIMITED), 'map'
    for child, stamps in edges.items():
        for stamp in [0] if stamps is None else stamps:
            buffer.insert(parent, child, stamp, Pose(x=1.0), static=stamps is None)
        parent = child
    return buffer


STAMPS = st.lists(st.integers(-50, 50), min_size=2, max_size=20, unique=True)


@given(STAMPS, STAMPS)
def test_slowest_edge_gives_the_stamps_that_all_edges_have_data_for(one, other):
    buffer = buffer_of(base=one, arm=None, hand=other)
    first, last = max(min(one), min(other)), min(max(one), max(other))
    if first > last:
        with pytest.raises(ExtrapolationException, match='no time in common'):
            stamps_of_slowest(buffer, 'map', 'hand')
        return
    rate, other_rate = ((len(each) - 1) / (max(each) - min(each)) for each in (one, other))
    slowest = other if other_rate <= rate else one  # if both are equal, the lower one
    expected = sorted(stamp for stamp in slowest if first <= stamp <= last)
    assert stamps_of_slowest(buffer, 'map', 'hand').tolist() == expected
    assert len(trajectory(buffer, 'map', 'hand', expected, outside='fail').stamps) == len(expected)


@given(st.integers(1, 5 * SECOND), st.floats(0.1, 2000.0))
def test_stamps_at_a_rate_have_answers_and_keep_the_rate(length, rate_hz):
    buffer = buffer_of(base=[START, START + length])
    stamps = stamps_at_rate(buffer, 'map', 'base', rate_hz)
    period = SECOND / rate_hz
    assert stamps[0] == START and START + length - period - 1 <= stamps[-1] <= START + length
    assert np.abs((stamps - START) - np.arange(len(stamps)) * period).max() <= 1.0


def test_nothing_that_moves_gives_no_stamps():
    buffer = buffer_of(base=None)
    for stamps in (stamps_of_slowest, lambda *frames: stamps_at_rate(*frames, 10.0)):
        with pytest.raises(InvalidArgumentException, match="between 'map' and 'base' are static"):
            stamps(buffer, 'map', 'base')


def test_rate_that_is_a_slip_of_the_finger_is_refused():
    buffer = buffer_of(base=[START, START + 100 * SECOND])
    with pytest.raises(InvalidArgumentException, match='more than the limit of 100000000'):
        stamps_at_rate(buffer, 'map', 'base', 1e9)


@pytest.mark.parametrize('rate_hz', [
    0.0, -1.0, math.nan, math.inf, 1e-300, 1e300, pytest.param(10**400, id='huge'), 'fast', None])
def test_what_is_no_rate_is_refused(rate_hz):
    buffer = buffer_of(base=[START, START + 100 * SECOND])
    with pytest.raises(InvalidArgumentException, match='rate_hz .* from 2e-10 to 1e9$'):
        stamps_at_rate(buffer, 'map', 'base', rate_hz)
    assert stamps_at_rate(buffer, 'map', 'base', 2e-10).tolist() == [START]


def test_start_and_stop_leave_out_the_others():
    buffer = buffer_of(base=[START, START + 10 * SECOND, START + 20 * SECOND])
    for stamps_of in (lambda **part: stamps_at_rate(buffer, 'map', 'base', 1.0, **part),
                      lambda **part: stamps_of_slowest(buffer, 'map', 'base', **part)):
        whole = stamps_of()
        for start, stop in ((START + 3 * SECOND, None), (None, START + 12 * SECOND),
                            (START + 10 * SECOND, START + 10 * SECOND), (1, START + 99 * SECOND)):
            kept = whole[(whole >= (start or whole[0])) & (whole <= (stop or whole[-1]))]
            assert stamps_of(start=start, stop=stop).tolist() == kept.tolist()
        with pytest.raises(InvalidArgumentException, match='nothing is left between'):
            stamps_of(start=START + 21 * SECOND)


def test_rate_of_an_edge_that_a_wrong_stamp_made_long_names_the_edge():
    buffer = buffer_of(base=[1, START, START + SECOND], wheel=[1, START])
    with pytest.raises(InvalidArgumentException, match='longest edge is map -> base, from 0.0'):
        stamps_at_rate(buffer, 'map', 'base', 50.0)
    assert len(stamps_at_rate(buffer, 'map', 'base', 50.0, start=START)) == 51


def test_stamps_without_an_answer_are_left_out_or_nan_or_an_error():
    buffer = buffer_of(base=[START, START + SECOND])
    asked = [START - 1, START, START + SECOND, START + SECOND + 1]
    skipped = trajectory(buffer, 'map', 'base', asked, twist=True)
    assert skipped.stamps.tolist() == asked[1:3] and skipped.outside == 2
    assert skipped.poses[:, 0].tolist() == [1.0, 1.0] and skipped.twists.shape == (2, 6)
    marked = trajectory(buffer, 'map', 'base', asked, twist=True, outside='nan')
    assert marked.stamps.tolist() == asked and marked.outside == 2
    for rows in (marked.poses, marked.twists):
        assert np.isnan(rows).all(axis=1).tolist() == [True, False, False, True]
    with pytest.raises(ExtrapolationException, match='2 of 4 stamps have no answer'):
        trajectory(buffer, 'map', 'base', asked, outside='fail')
    with pytest.raises(InvalidArgumentException, match="'skip', 'nan' or 'fail', not 'raise'"):
        trajectory(buffer, 'map', 'base', asked, outside='raise')


def test_velocity_is_that_of_the_source_in_the_axes_of_the_target():
    """A wheel moves around a post at 2 m, half a radian a second."""
    buffer = BufferCore(UNLIMITED)
    for number in range(101):
        t = 0.01 * number
        buffer.insert('map', 'post', START + number * 10 * MS, Pose.from_xyz_rpy(yaw=0.5 * t))
    buffer.insert('post', 'wheel', 0, Pose(x=2.0), static=True)
    taken = trajectory(buffer, 'map', 'wheel', stamps_at_rate(buffer, 'map', 'wheel', 20.0),
                       twist=True)
    seconds = (taken.stamps - START) / SECOND
    expected = np.zeros((len(seconds), 6))
    expected[:, 0], expected[:, 1] = -np.sin(0.5 * seconds), np.cos(0.5 * seconds)
    expected[:, 5] = 0.5
    np.testing.assert_allclose(taken.twists, expected, atol=1e-7)


def test_missing_pandas_is_named_with_the_extra_that_has_it(monkeypatch):
    buffer = BufferCore(cache_time=UNLIMITED)
    buffer.insert('map', 'base', SECOND, Pose())
    monkeypatch.setitem(sys.modules, 'pandas', None)
    with pytest.raises(ImportError, match='extra "notebook".*pip install pandas'):
        trajectory(buffer, 'map', 'base', [SECOND]).to_frame()


def test_frame_of_pandas_goes_there_and_back():
    pandas = pytest.importorskip('pandas')
    begin = 1_700_000_000_000_000_001
    buffer = BufferCore(cache_time=UNLIMITED)
    stamps = begin + np.arange(5) * 100_000_000
    buffer.insert_track(
        'map', 'base', stamps, [Pose.from_xyz_rpy(i, yaw=0.1 * i) for i in range(5)])
    taken = trajectory(buffer, 'map', 'base', stamps, twist=True)
    frame = taken.to_frame()
    assert list(frame.columns) == [*POSE_COLUMNS, *TWIST_COLUMNS]
    assert frame.index.name == 'time' and frame.index[0] == pandas.Timestamp(begin)
    again = BufferCore(cache_time=UNLIMITED)
    assert again.insert_track('map', 'base', frame.index, frame[list(POSE_COLUMNS)]) == []
    assert np.array_equal(again.lookup_many('map', 'base', stamps), taken.poses)
