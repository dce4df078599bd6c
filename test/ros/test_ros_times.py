# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""ROS times wherever a buffer takes stamps."""

import pickle

import numpy as np
import pytest
from rclpy.time import Time
from ros_helpers import at, lasting, transform
from tf_tree_py import Buffer, deskew, InvalidArgumentException, Pose


@pytest.fixture
def buffer():
    buffer = Buffer()
    for second in range(1, 5):
        buffer.set_transform(transform('map', 'base', second, x=float(second)), 'me')
    return buffer


def test_core_queries_take_ros_times(buffer):
    for frozen in (buffer, buffer.snapshot(), pickle.loads(pickle.dumps(buffer.snapshot()))):
        for time in (at(2.0), at(2.0).to_msg(), Time(seconds=2), 2 * 10**9,
                     np.datetime64(2, 's')):
            assert frozen.lookup('map', 'base', time) == Pose(2.0)
            assert frozen.lookup_full('map', time, 'base', time, 'map') == Pose(2.0)
            assert frozen.lookup_tree('map', time)['base'] == Pose(2.0)
            assert frozen.frames_between('map', 'base', time) == ['base', 'map']
            assert len(frozen.edges_between('map', 'base', time)) == 1
            assert frozen.lookup_many('map', 'base', [time, 10**9])[:, 0].tolist() == [2.0, 1.0]
        assert frozen.lookup('map', 'base', Time()) == Pose(4.0)
        header = transform('map', 'base', 3.0).header
        assert frozen.lookup_many('map', 'base', [header.stamp])[0, 0] == 3.0


def test_points_and_velocities_take_ros_times(buffer):
    times = [at(1.0), at(2.0)]
    assert deskew(buffer, np.zeros((2, 3)), times, 'map', 'base', times[0], 'map')[1, 0] == 2.0
    assert buffer.lookup_twist_many('base', 'map', times, lasting(1.0))[:, 0] == pytest.approx(1)


def test_insertions_take_ros_times(buffer):
    assert buffer.insert('map', 'base', at(5.0), Pose(5.0)) == []
    assert buffer.insert_track('map', 'base', [at(6.0).to_msg(), at(7.0)], [Pose(6.0)] * 2) == []
    assert buffer.lookup('map', 'base', at(7.0)) == Pose(6.0)


@pytest.mark.parametrize('time', [1.0, 'now', None, lasting(1.0)])
def test_what_is_no_stamp_is_refused(buffer, time):
    with pytest.raises(InvalidArgumentException, match='stamps are integer nanoseconds'):
        buffer.lookup('map', 'base', time)
    with pytest.raises(InvalidArgumentException, match='stamps? .*integer nanoseconds|not a row'):
        buffer.lookup_many('map', 'base', [time])


def test_buffer_and_its_snapshot_say_what_they_hold(buffer):
    text = '2 frames, 1 edge (0 static), 1.000000000 to 4.000000000 s'
    assert repr(buffer) == f'<Buffer: {text}>'
    assert repr(buffer.snapshot()) == f'<RosSnapshot: {text}>'
    assert 'base  4 samples in 3.000 s' in buffer._repr_html_()
    with pytest.raises(TypeError, match='a Buffer cannot be pickled or copied'):
        pickle.dumps(buffer)
