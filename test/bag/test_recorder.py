# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A buffer is recorded as a bag that opens as the same buffer, to the bit."""

from bags import fed, random_pose, RUN, SECOND, START, write_ros2
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from tf_tree_py import BufferCore, load, Spline
from tf_tree_py.bag import BagError, open_bag, read_messages
from tf_tree_py.core import Pose, se3, UNLIMITED
from tf_tree_py.files.tree_file import saved_tree


def content(buffer):
    """Return the content of a buffer as bytes, without publishers and the order of frames."""
    tree = buffer.snapshot()._tree
    for history in tree.histories.values():
        history.authority = ''
    tree.histories = dict(sorted(tree.histories.items()))
    tree.frames = dict.fromkeys(sorted(tree.frames))
    tree.cache_time = 0
    return saved_tree(tree).as_bytes()


@pytest.mark.parametrize('name', ['incident.mcap', 'incident'])
def test_recording_opens_as_the_buffer_to_the_bit(tmp_path, name):
    buffer = fed(RUN)
    buffer.record(tmp_path / name)
    assert content(open_bag(tmp_path / name)) == content(buffer)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_recordings_and_loaded_trees_are_recorded_too(tmp_path):
    first = open_bag(write_ros2(tmp_path / 'run', RUN))
    first.record(tmp_path / 'second.mcap')
    first.save(tmp_path / 'run.tftree')
    load(tmp_path / 'run.tftree').record(tmp_path / 'third.mcap')
    assert content(first) == content(open_bag(tmp_path / 'second.mcap')) == content(
        open_bag(tmp_path / 'third.mcap'))


def test_window_of_a_live_buffer_is_recorded_and_no_more(tmp_path, rng):
    buffer = BufferCore(SECOND)
    for number in range(500):
        buffer.insert('map', 'base', START + number * SECOND // 100, random_pose(rng))
    buffer.insert('map', 'table', START, Pose(x=1.0), static=True)
    buffer.record(tmp_path / 'incident.mcap')
    again = open_bag(tmp_path / 'incident.mcap')
    assert content(again) == content(buffer)
    assert len(again.edges()) == 2


def test_frame_that_was_hung_elsewhere_and_a_corrected_sample_are_recorded(tmp_path, rng):
    buffer = BufferCore(UNLIMITED)
    for number in range(20):
        buffer.insert('map', 'base', START + number * SECOND, random_pose(rng))
        buffer.insert('table' if number < 8 else 'base', 'cup', START + number * SECOND,
                      random_pose(rng))
    buffer.insert('map', 'base', START + 19 * SECOND, random_pose(rng))
    buffer.insert('base', 'cup', START + 12 * SECOND, random_pose(rng))
    buffer.record(tmp_path / 'incident.mcap')
    with pytest.warns(UserWarning, match='repeated stamp'):
        assert content(open_bag(tmp_path / 'incident.mcap')) == content(buffer)


@pytest.mark.parametrize('edges', [[], [('map', 'table', True)], [('map', 'base', False)]],
                         ids=['nothing', 'static only', 'moving only'])
def test_little_is_recorded_as_well(tmp_path, edges, rng):
    buffer = BufferCore()
    for parent, child, static in edges:
        buffer.insert(parent, child, START, random_pose(rng), static=static)
    buffer.record(tmp_path / 'little.mcap')
    assert content(open_bag(tmp_path / 'little.mcap')) == content(buffer)


def test_static_edges_come_first_and_are_kept_for_late_listeners(tmp_path):
    fed(RUN).record(tmp_path / 'incident')
    arrivals = list(read_messages(tmp_path / 'incident'))
    assert [arrival.connection.topic for arrival in arrivals[:2]] == ['/tf_static', '/tf']
    received = [arrival.received for arrival in arrivals]
    assert received == sorted(received)
    assert received[0] == received[1] == START


def test_other_readers_find_messages_of_the_official_type(tmp_path):
    """The reader checks the type's hash, and reads every message field by field."""
    fed(RUN).record(tmp_path / 'incident')
    with AnyReader([tmp_path / 'incident']) as reader:
        durable = {connection.topic: connection.ext.offered_qos_profiles[0].durability
                   for connection in reader.connections}
        assert durable == {'/tf': QosDurability.VOLATILE,
                           '/tf_static': QosDurability.TRANSIENT_LOCAL}
        stamps = [transform.header.stamp.sec * SECOND + transform.header.stamp.nanosec
                  for connection, _, data in reader.messages() if connection.topic == '/tf'
                  for transform in reader.deserialize(data, connection.msgtype).transforms]
    assert stamps == sorted(stamps)
    assert len(stamps) == sum(len(message.transforms) for message in RUN
                              if message.topic == '/tf')


def test_what_is_there_is_not_replaced_and_what_cannot_be_written_is_told(tmp_path):
    buffer = fed(RUN[:4])
    (tmp_path / 'there.mcap').write_text('precious')
    for name, sentence in (('there.mcap', 'exists already'),
                           ('incident.bag', 'a .mcap file, or a folder'),
                           ('nowhere/incident.mcap', 'cannot be written: No such file')):
        with pytest.raises(BagError, match=sentence):
            buffer.record(tmp_path / name)
    assert (tmp_path / 'there.mcap').read_text() == 'precious'
    assert [path.name for path in tmp_path.iterdir()] == ['there.mcap']


def test_folder_that_cannot_be_removed_afterwards_is_no_error(tmp_path, monkeypatch):
    """As where an interrupt comes while it is removed, or on a network drive."""
    def refuse(*_, **__):
        raise OSError

    monkeypatch.setattr('os.rmdir', refuse)
    fed(RUN[:4]).record(tmp_path / 'incident.mcap')
    assert open_bag(tmp_path / 'incident.mcap').frames()


def test_spline_is_recorded_as_poses_that_follow_it(tmp_path):
    seconds = np.arange(0.0, 4.001, 0.025)
    stamps = START + (seconds * SECOND).astype(np.int64)
    poses = [Pose.from_xyz_rpy(x=np.sin(6.0 * t), yaw=np.cos(5.0 * t)) for t in seconds]
    spline = Spline.fit(stamps, poses, 20.0)
    buffer = BufferCore(UNLIMITED)
    buffer.insert_track('map', 'odom', stamps[::4], poses[::4])
    buffer.insert_curve('odom', 'base', spline)
    buffer.record(tmp_path / 'incident.mcap')
    again = open_bag(tmp_path / 'incident.mcap')
    edges = [edge[1:2] + edge[4:] for edge in again.edges()]
    assert edges == [('odom', 41, stamps[0], stamps[-1]),
                     ('base', 10 * spline.pieces + 1, stamps[0], stamps[-1])]
    knots, asked = stamps[::2], np.arange(stamps[0], stamps[-1], SECOND // 777)
    from_knot_to_knot = BufferCore(UNLIMITED)
    from_knot_to_knot.insert_track('odom', 'base', knots, spline.poses(knots))
    fine, coarse = (np.max(se3.distance_many(
        spline.poses(asked), one.lookup_many('odom', 'base', asked)), axis=1)
        for one in (again, from_knot_to_knot))
    assert (fine < 0.012 * coarse).all()
    buffer.clear()
    buffer.record(tmp_path / 'nothing.mcap')
    assert open_bag(tmp_path / 'nothing.mcap').edges() == []


def test_of_an_aided_edge_the_poses_are_recorded(tmp_path, rng):
    plain, aided = (BufferCore(UNLIMITED) for _ in range(2))
    for number in range(20):
        pose = random_pose(rng)
        plain.insert('map', 'base', START + number * SECOND, pose)
        aided.insert('map', 'base', START + number * SECOND, pose, covariance=np.eye(6))
    stamps = START + np.arange(0, 10 * SECOND, SECOND // 50)
    aided.aid('base', stamps, rng.normal(size=(len(stamps), 3)))
    aided.aid('camera', stamps, rng.normal(size=(len(stamps), 3)))
    aided.record(tmp_path / 'incident.mcap')
    assert content(open_bag(tmp_path / 'incident.mcap')) == content(plain)
