# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recorded covariances are assigned to their edges, and problems are reported."""

import warnings

from bags import (
    estimate,
    JAZZY,
    LATCHED,
    Message,
    ODOMETRY,
    PERIOD,
    random_pose,
    SECOND,
    START,
    write_ros1,
    write_ros2,
)
import numpy as np
import pytest
from tf_tree_py.bag import BagError, BagWarning, Covariances, open_bag
from tf_tree_py.bag.files.connections import Connection, decode
from tf_tree_py.beyond.uncertainty.insertion import estimate_in
from tf_tree_py.core import Kind, Pose
from tf_tree_py.core.messages.byte_cursor import WireError

NOW = START + SECOND
ROBOT = Pose.from_xyz_rpy(x=5.0, yaw=np.pi / 2)
# Of x, y and the rotation about z, as of all robots on a floor.
SURE = np.diag([1e-4, 4e-4, 0.0, 0.0, 0.0, 1e-4])
UNKNOWN = SURE + np.diag([0.0, 0.0, 1e6, 1e6, 1e6, 0.0])
AMCL = {'/amcl_pose': Covariances(child='base', edge=('map', 'odom'))}
WHEELS = {'/odometry': Covariances()}

MOVING = [Message(stamp, '/tf', [
    ('map', 'odom', stamp, Pose(x=2.0)),
    ('odom', 'base', stamp, Pose.from_xyz_rpy(x=3.0, yaw=np.pi / 2))])
    for stamp in (START, NOW, NOW + SECOND)]
RUN = [Message(START, '/tf_static', [('base', 'camera', 0, Pose(x=1.0))], LATCHED), *MOVING]


def localised(stamp=NOW, covariance=SURE, **options):
    return estimate('/amcl_pose', options.pop('parent', 'map'), '', stamp, ROBOT, covariance,
                    **options)


def driven(stamp=NOW, covariance=SURE, parent='odom', child='base', topic='/odometry', **options):
    return estimate(topic, parent, child, stamp, Pose(x=9.0), covariance, **options)


def mounted(**options):
    return driven(START, np.eye(6) * 1e-6, 'base', 'camera', '/tf_static_covariance', **options)


def opened(folder, *messages, **options):
    """Return the recording of the robot and some more messages; a warning is an error."""
    path = write_ros2(folder / f'run{len(list(folder.iterdir()))}', [*RUN, *messages])
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        return open_bag(path, **options)


def covariance_of(buffer, target, source, stamp=NOW):
    return buffer.lookup_uncertain(target, source, stamp)[1]


def on_the_floor(x, y, turn, x_turn=0.0, y_turn=0.0):
    covariance = np.diag([x, y, 0.0, 0.0, 0.0, turn])
    covariance[[0, 5], [5, 0]], covariance[[1, 5], [5, 1]] = x_turn, y_turn
    return covariance


# --- numbers by hand

@pytest.mark.parametrize('ros1', [False, True], ids=['ROS 2', 'ROS 1'])
def test_localisation_and_odometry_are_the_numbers_by_hand(ros1, tmp_path):
    """The robot is 3 m ahead of odom's origin and faces left; its camera is 1 m ahead of it."""
    messages = [*RUN, localised(ros1=ros1), driven(ros1=ros1, covariance=UNKNOWN)]
    write = write_ros1 if ros1 else write_ros2
    path = write(tmp_path / ('run.bag' if ros1 else 'run'), messages)
    buffer = open_bag(path, covariances=AMCL)
    # A rotation about the robot moves odom's origin, 3 m behind, in the opposite direction.
    for source, wanted in (('odom', on_the_floor(1e-4, 4e-4 + 9e-4, 1e-4, y_turn=-3e-4)),
                           ('base', SURE),
                           ('camera', on_the_floor(2e-4, 4e-4, 1e-4, x_turn=-1e-4))):
        np.testing.assert_allclose(covariance_of(buffer, 'map', source), wanted, atol=1e-15)
    assert not covariance_of(buffer, 'odom', 'base').any()
    buffer = open_bag(path, covariances={'/odometry': Covariances(planar=True)})
    np.testing.assert_allclose(covariance_of(buffer, 'odom', 'base'), SURE)
    # Its pose is not used: that is on /tf.
    assert buffer.lookup('odom', 'base', NOW).x == 3.0
    assert not covariance_of(buffer, 'map', 'odom').any()


def test_child_that_an_odometry_does_not_mean_is_replaced(tmp_path):
    buffer = opened(tmp_path, driven(child='wheels'),
                    covariances={'/odometry': Covariances(child='base')})
    np.testing.assert_allclose(covariance_of(buffer, 'odom', 'base'), SURE)


def test_static_covariances_are_found_by_themselves(tmp_path):
    for options in {}, {'qos': LATCHED}:
        buffer = opened(tmp_path, mounted(**options), start=NOW)
        np.testing.assert_allclose(covariance_of(buffer, 'base', 'camera'), 1e-6 * np.eye(6))
    # An explicit list of topics excludes others.
    buffer = opened(tmp_path, mounted(), topics=['/tf', '/tf_static'])
    assert not covariance_of(buffer, 'base', 'camera').any()
    buffer = opened(tmp_path, mounted()._replace(type_name='std_msgs/msg/String'))
    assert not covariance_of(buffer, 'base', 'camera').any()


def test_poses_are_taken_where_nothing_else_tells_them(tmp_path):
    path = write_ros2(tmp_path / 'run', [driven(), driven(NOW + SECOND), localised()])
    with pytest.raises(BagError, match='no topic with transforms'):
        open_bag(path, covariances=WHEELS)
    # It has no map -> odom, for which the robot's pose in odom is on the other topic.
    with pytest.warns(BagWarning, match="covariances of no edge 'map' -> 'odom': once"):
        buffer = open_bag(path, covariances={
            **AMCL, '/odometry': Covariances(with_poses=True)})
    assert buffer.lookup('odom', 'base', NOW + SECOND // 2).x == 9.0
    np.testing.assert_allclose(covariance_of(buffer, 'odom', 'base'), SURE)
    assert len(buffer.oddities) == 1


def test_a_pose_is_used_although_its_covariance_is_not_set(tmp_path):
    path = write_ros2(tmp_path / 'run', [
        driven(covariance=np.zeros((6, 6))), driven(NOW + SECOND, covariance=UNKNOWN)])
    with pytest.warns(BagWarning, match='it is all zero: the sender did not set it'):
        buffer = open_bag(path, odometry='/odometry')
    assert buffer.lookup('odom', 'base', NOW + SECOND // 2).x == 9.0
    assert not covariance_of(buffer, 'odom', 'base').any()
    assert buffer.statistics.incidents[Kind.POSE_ALONE] == 2
    assert (buffer.statistics.accepted, buffer.statistics.refused) == (2, 0)


# --- options of open_bag

def test_stretch_of_time_holds_for_covariances_too(tmp_path):
    messages = [localised(START + n * SECOND // 2, n * SURE) for n in (1, 2, 3)]
    whole = opened(tmp_path, *messages, covariances=AMCL)
    part = opened(tmp_path, *messages, covariances=AMCL, start=NOW, stop=NOW + 1)
    np.testing.assert_allclose(covariance_of(whole, 'map', 'base'), 2 * SURE, atol=1e-15)
    np.testing.assert_allclose(covariance_of(whole, 'map', 'base', NOW + SECOND), 3 * SURE,
                               atol=1e-15)
    assert len(part.lookup_budget('map', 'base', NOW)) == 1
    assert covariance_of(part, 'map', 'base')[0, 0] == pytest.approx(2e-4)


def test_frames_are_called_as_those_of_the_transforms(tmp_path):
    buffer = opened(
        tmp_path, localised(), driven(), frame_prefix={'/tf': 'r/', '/amcl_pose': 'r/'},
        shared_frames=['map'], covariances={
            '/amcl_pose': Covariances(child='r/base', edge=('map', 'r/odom'))})
    np.testing.assert_allclose(covariance_of(buffer, 'map', 'r/base'), SURE, atol=1e-15)
    buffer = opened(tmp_path, driven(), mounted(), frame_prefix='r/', covariances=WHEELS)
    for edge in ('r/odom', 'r/base'), ('r/base', 'r/camera'):
        assert covariance_of(buffer, *edge).any()
    buffer = opened(tmp_path, localised(), driven(), frames=['map', 'odom'],
                    covariances=WHEELS)
    assert set(buffer.frames()) == {'map', 'odom'} and not buffer.oddities


def test_filter_of_edges_holds_for_their_covariances(tmp_path):
    def is_wanted(parent, child):
        return (parent, child) != ('odom', 'base')

    buffer = opened(tmp_path, localised(), driven(), mounted(), frames=is_wanted,
                    covariances=WHEELS)
    assert {edge.child for edge in buffer.edges()} == {'odom', 'camera'}
    assert not buffer.oddities
    assert covariance_of(buffer, 'base', 'camera').any()


# --- problems

@pytest.mark.parametrize(('message', 'reason', 'edge', 'sentence'), [
    (localised(covariance=UNKNOWN), Kind.BAD_COVARIANCE, ('map', 'base'),
     r'1e\+06 rad\^2.*planar=True'),
    (localised(covariance=0 * SURE), Kind.BAD_COVARIANCE, ('map', 'base'),
     'the sender did not set it'),
    (localised(covariance=-SURE), Kind.BAD_COVARIANCE, ('map', 'base'), '-1 means unknown'),
    (localised(parent='world'), Kind.BAD_COVARIANCE, ('world', 'base'),
     "a pose in 'world', which is not the parent of the edge .'map', 'odom'."),
    (localised(parent=''), Kind.EMPTY_FRAME, ('', 'base'), 'frame_id is not set'),
    (localised(NOW + 9 * SECOND), Kind.BAD_COVARIANCE, ('map', 'base'),
     "the pose of 'odom' at that time is not available: .* extrapolation into the future"),
    (localised()._replace(data=localised().data[:-300]), Kind.MALFORMED, ('', ''),
     '/amcl_pose: the message cannot be decoded'),
])
def test_what_cannot_be_used_is_told_once(message, reason, edge, sentence, tmp_path):
    path = write_ros2(tmp_path / 'run', [*RUN, message, message])
    with pytest.warns(BagWarning, match=sentence):
        buffer = open_bag(path, covariances=AMCL)
    [oddity] = buffer.oddities
    assert (oddity.reason, oddity.times) == (reason.value, 2)
    assert (oddity.parent, oddity.child) == edge
    assert buffer.statistics.incidents[reason] == 2
    assert not covariance_of(buffer, 'map', 'base').any()


def test_covariances_that_nobody_would_ever_see_are_told(tmp_path):
    path = write_ros2(tmp_path / 'run', [*RUN, driven(child='wheels'), driven(parent='map')])
    with pytest.warns(BagWarning, match=r'covariances of no edge .*Covariances\(child='):
        buffer = open_bag(path, covariances=WHEELS)
    assert {(oddity.parent, oddity.child, oddity.times) for oddity in buffer.oddities} == {
        ('odom', 'wheels', 1), ('map', 'base', 1)}


@pytest.mark.parametrize(('covariances', 'sentence'), [
    ({'/amcl': Covariances(child='base')}, 'no topic /amcl; it has: /amcl_pose, /tf'),
    ({'/amcl_pose': Covariances()}, 'covariances of /amcl_pose: .*pass child='),
    ({'/tf': Covariances()}, 'tf2_msgs/msg/TFMessage is neither Odometry nor'),
    ({'/amcl_pose': ('map', 'odom')}, 'a dictionary of topics, such as'),
    ({'/amcl_pose': None}, 'a dictionary of topics, such as'),
    (['/amcl_pose'], 'a dictionary of topics, such as'),
    ('/amcl_pose', 'a dictionary of topics, such as'),
])
def test_arguments_that_are_wrong_are_told(covariances, sentence, tmp_path):
    with pytest.raises(BagError, match=sentence) as raised:
        opened(tmp_path, localised(), covariances=covariances)
    assert '\n' not in str(raised.value)


@pytest.mark.parametrize(('words', 'sentence'), [
    ({'edge': 'od'}, "such as .'map', 'odom'., not 'od'"),
    ({'edge': ('map', 'odom', 'base')}, 'edge is .parent, child.'),
    ({'edge': 5}, 'edge is .parent, child.'),
    ({'child': 5}, 'child is the name of a frame, not 5'),
    ({'edge': ('map', 'odom'), 'with_poses': True}, 'is another edge'),
])
def test_words_that_do_not_fit_together_are_told(words, sentence):
    with pytest.raises(ValueError, match=sentence):
        Covariances(**words)


# --- bytes

@pytest.mark.parametrize('ros1', [False, True], ids=['ROS 2', 'ROS 1'])
def test_a_part_of_a_message_is_none(ros1):
    data = localised(ros1=ros1).data
    assert len(data) > 300
    encoding = 'ros1' if ros1 else 'cdr'
    connection = Connection('/amcl_pose', localised().type_name, False, '', encoding)
    for size in range(len(data)):
        with pytest.raises(WireError, match='the message cannot be decoded'):
            decode(connection, data[:size])


def test_other_byte_order_is_read():
    message = JAZZY.deserialize_cdr(driven().data, ODOMETRY)
    data = bytes(JAZZY.serialize_cdr(message, ODOMETRY, little_endian=False))
    found = estimate_in(decode(Connection('/odom', ODOMETRY, False, ''), data))
    assert found[:4] == ('odom', 'base', NOW, Pose(x=9.0))
    np.testing.assert_array_equal(found.covariance, SURE.ravel())
    assert found.covariance.dtype.isnative


def test_odometry_moves_an_edge_of_a_bag_without_transforms(tmp_path, rng):
    messages = [estimate('/odom', 'odom', 'base', START + number * PERIOD, random_pose(rng),
                         np.eye(6)) for number in range(10)]
    bag = write_ros2(tmp_path / 'run', messages)
    with pytest.raises(BagError, match=r"odometry='/odom'\) makes an edge of its odometry"):
        open_bag(bag)
    tree = open_bag(bag, odometry='/odom')
    assert [(edge.parent, edge.child, edge.samples) for edge in tree.edges()] == [
        ('odom', 'base', 10)]


def test_topic_named_tf_of_another_type_is_told(tmp_path, rng):
    message = estimate('/tf', 'odom', 'base', START, random_pose(rng), np.eye(6))
    with pytest.raises(BagError, match='/tf has messages of type nav_msgs/Odometry, not tf2_msgs'):
        open_bag(write_ros2(tmp_path / 'run', [message]))
