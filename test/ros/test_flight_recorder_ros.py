# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``Buffer(flight_recorder=...)`` writes received messages to a bag when a lookup fails."""

import pytest
from ros_helpers import at, lasting, LATEST, PATIENCE
from tf_tree_py import Buffer, FlightRecorder, Pose, TransformException
from tf_tree_py.bag import open_bag
from tf_tree_py.ros.messages.convert import transform_stamped


def test_first_lost_lookup_records_what_a_listener_heard(tmp_path, node, talker, listen):
    recorder = FlightRecorder(tmp_path)
    buffer = listen(node, Buffer(flight_recorder=recorder))
    talker.fix(transform_stamped('base', 'lidar', 0, Pose(z=1.0)))
    talker.move(transform_stamped('odom', 'base', 100 * 10**9, Pose(x=2.0)))
    with pytest.raises(TransformException):  # it never worked before
        buffer.lookup_transform('odom', 'nowhere', LATEST)
    buffer.lookup_transform('odom', 'lidar', at(100.0), PATIENCE)
    for _ in range(2):
        with pytest.raises(TransformException):
            buffer.lookup_transform('odom', 'lidar', at(101.0), lasting(0.05))
    recorder.close()
    bag, = tmp_path.glob('*_lookup_failed.mcap')
    assert open_bag(bag).lookup('odom', 'lidar', 100 * 10**9) == Pose(x=2.0, z=1.0)
