# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joint states of a bag and a robot's description become edges that were not recorded."""

import warnings

from bags import JAZZY, Message, NOETIC, SECOND, START, write_ros1, write_ros2
from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py.bag import BagError, BagWarning, open_bag
from tf_tree_py.bag.opening import JointStateReader
from tf_tree_py.core import Pose
from tf_tree_py.urdf import DescriptionError, Robot

TYPE = 'sensor_msgs/msg/JointState'
ARM = """
<robot name="arm">
  <link name="base"/><link name="plate"/><link name="upper"/><link name="slide"/>
  <link name="tool"/>
  <joint name="mount" type="fixed"><parent link="base"/><child link="plate"/>
    <origin xyz="0 0 0.3"/></joint>
  <joint name="shoulder" type="revolute"><parent link="plate"/><child link="upper"/>
    <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/>
    </joint>
  <joint name="reach" type="prismatic"><parent link="upper"/><child link="slide"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="3" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="continuous"><parent link="slide"/><child link="tool"/>
    <axis xyz="0 1 0"/><mimic joint="shoulder" multiplier="-2"/></joint>
</robot>
"""
NAMES = ('shoulder', 'reach')
POSITIONS = np.array([[0.01 * number, 0.5 + 0.3 * np.sin(number)] for number in range(100)])
STAMPS = [START + number * SECOND // 50 for number in range(100)]


def message_of(types, stamp, names, positions):
    header, time = types.types['std_msgs/msg/Header'], types.types['builtin_interfaces/msg/Time']
    seq = {'seq': 7} if types is NOETIC else {}
    nothing = np.empty(0)
    return types.types[TYPE](
        header=header(stamp=time(*divmod(stamp, SECOND)), frame_id='an odd one', **seq),
        name=list(names), position=np.array(positions, float), velocity=nothing, effort=nothing)


def as_bytes(ros1, *said, little_endian=True):
    if ros1:
        return bytes(NOETIC.serialize_ros1(message_of(NOETIC, *said), TYPE))
    return bytes(JAZZY.serialize_cdr(message_of(JAZZY, *said), TYPE, little_endian=little_endian))


def states(ros1=False, topic='/joint_states'):
    return [Message(stamp + 1000, topic, [], type_name=TYPE,
                    data=as_bytes(ros1, stamp, NAMES, positions))
            for stamp, positions in zip(STAMPS, POSITIONS, strict=True)]


@pytest.fixture(scope='module')
def robot(tmp_path_factory):
    path = tmp_path_factory.mktemp('robot') / 'arm.urdf'
    path.write_text(ARM)
    return path


@pytest.mark.parametrize('ros1', [False, True])
def test_bag_without_transforms_answers_as_the_description_says(tmp_path, robot, ros1):
    bag = (write_ros1 if ros1 else write_ros2)(
        tmp_path / ('run.bag' if ros1 else 'run'), states(ros1))
    with pytest.raises(BagError, match='no topic with transforms'):
        open_bag(bag)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        buffer = open_bag(bag, robot=robot)
    edges = Robot.load(robot).edges(dict(zip(NAMES, POSITIONS.T, strict=True)))
    for (parent, child), poses in edges.items():
        expected = np.broadcast_to(np.asarray(poses), (100, 7))
        answers = buffer.lookup_many(parent, child, STAMPS)
        np.testing.assert_allclose(answers, expected, atol=1e-12)
    assert {edge.child: edge.static for edge in buffer.edges()} == {
        'plate': True, 'upper': False, 'slide': False, 'tool': False}
    assert buffer.lookup('base', 'plate').z == 0.3


def test_recorded_transforms_win_and_names_and_times_are_the_options(tmp_path, robot):
    where = tuple(Pose(x=9.0))
    recorded = [Message(stamp, '/tf', [('upper', 'slide', stamp, where), ('map', 'base', stamp,
                                                                          where)])
                for stamp in STAMPS]
    bag = write_ros2(tmp_path / 'run', sorted(recorded + states(), key=lambda each: each.received))
    buffer = open_bag(bag, robot=Robot.load(robot), frame_prefix='r1/', shared_frames=['map'],
                      start=STAMPS[10], stop=STAMPS[20])
    assert buffer.lookup('r1/upper', 'r1/slide') == Pose(x=9.0)
    edges = {edge.child: edge for edge in buffer.edges()}
    assert edges.keys() == {'r1/base', 'r1/plate', 'r1/upper', 'r1/slide', 'r1/tool'}
    assert (edges['r1/tool'].oldest, edges['r1/tool'].latest) == (STAMPS[10], STAMPS[19])
    assert edges['r1/tool'].authority == '/joint_states'
    assert len(open_bag(bag, robot=robot, frames=['upper', 'slide', 'plate']).edges()) == 2


def test_joint_states_with_an_older_or_a_repeated_stamp_are_told(tmp_path, robot):
    sent = states()[:6]
    late = [*sent[:3], sent[1], *sent[3:], sent[5]]
    bag = write_ros2(tmp_path / 'run', [
        each._replace(received=START + number) for number, each in enumerate(late)])
    with pytest.warns(BagWarning):
        buffer = open_bag(bag, robot=robot)
    told = {(one.reason, one.first) for one in buffer.oddities if one.child == 'upper'}
    assert told == {('out of order', STAMPS[1]), ('repeated stamp', STAMPS[5])}


def test_of_several_topics_one_is_named(tmp_path, robot):
    bag = write_ros2(tmp_path / 'run', [*states(topic='/a/joints'), *states(topic='/b/joints')])
    with pytest.raises(BagError, match='joint states on /a/joints, /b/joints: choose those of'):
        open_bag(bag, robot=robot)
    with pytest.raises(BagError, match='no joint states on /c; topics with some: /a/joints, /b'):
        open_bag(bag, robot=robot, joint_topic='/c')
    buffer = open_bag(bag, robot=robot, joint_topic='/b/joints', frame_prefix={'/b/joints': 'b/'})
    assert buffer.frames()[:2] == ['b/plate', 'b/base']


def test_what_does_not_fit_is_told(tmp_path, robot):
    odd = Message(START, '/joint_states', [], type_name=TYPE,
                  data=as_bytes(False, START, ['elbow'], [1.0]))
    cut = odd._replace(data=states()[0].data[:60])
    with pytest.raises(BagError, match="moves no joint of the robot 'arm', which has shoulder, r"):
        open_bag(write_ros2(tmp_path / 'odd', [odd]), robot=robot)
    bag = write_ros2(tmp_path / 'both', [odd, cut, *states()])
    with pytest.warns(BagWarning) as told:
        assert len(open_bag(bag, robot=robot).edges()) == 4
    assert "'elbow'" in str(told[0].message)
    assert 'unreadable joint states: once' in str(told[0].message)
    with pytest.raises(BagError, match='missing.urdf cannot be read: No such file'):
        open_bag(bag, robot=tmp_path / 'missing.urdf')
    with pytest.raises(DescriptionError):
        open_bag(bag, robot=write_file(tmp_path / 'bad.urdf', ARM.replace('parent', 'parrot')))
    with pytest.raises(BagError, match='has no topic with joint states'):
        open_bag(write_ros2(tmp_path / 'tf', [Message(START, '/tf', [
            ('map', 'base', START, tuple(Pose()))])]), robot=robot)


def write_file(path, text):
    path.write_text(text)
    return path


@given(st.lists(st.lists(st.text(st.characters(exclude_characters='\0', exclude_categories=['Cs']),
                                 max_size=9), max_size=4), min_size=1, max_size=4),
       st.lists(st.floats(allow_nan=False), max_size=4), st.integers(0, 2**31 * SECOND - 1),
       st.booleans(), st.booleans())
def test_reader_says_what_rosbags_says(names, positions, stamp, ros1, little_endian):
    reader = JointStateReader(ros1)
    for some in [*names, *names]:
        data = as_bytes(ros1, stamp, some, positions, little_endian=little_endian)
        state = reader.read(data)
        assert (state.stamp, list(state.names), list(state.positions)) == (stamp, some, positions)
        for end in range(len(data) - 8):  # two empty arrays are at the end
            with pytest.raises(ValueError):
                JointStateReader(ros1).read(data[:end])
