# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Warnings about recordings, robots and observations are at the line of the caller."""

from dataclasses import replace
from importlib import util

from bags import driving, Message, SECOND, write_ros2
from calibration_scenes import EDGE, scene
import pytest
from tf_tree_py import trajectory
from tf_tree_py.bag import open_bag
from tf_tree_py.bag.files import rosbags_file
from tf_tree_py.calibration import calibrate, CalibrationError
from tf_tree_py.core import TransformWarning
from tf_tree_py.urdf import joint_tracks, JointState, Robot
from warned_lines import assert_warns_at_its_line

MESSAGES = driving(count=5)
BEGIN = MESSAGES[0].received // SECOND
ODD = Message(MESSAGES[-1].received + 1, '/tf', [], data=b'not a message')
ROBOT = Robot.parse('<robot name="r"><link name="a"/></robot>')


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_ros2(tmp_path_factory.mktemp('fine') / 'run', MESSAGES)


@pytest.fixture(scope='module')
def odd_bag(tmp_path_factory):
    return write_ros2(tmp_path_factory.mktemp('odd') / 'run', [*MESSAGES, ODD])


def test_oddities_are_warned_of_where_the_bag_is_opened(odd_bag):
    assert_warns_at_its_line(lambda: open_bag(odd_bag))


def test_short_window_of_a_bag_is_warned_of_where_it_is_given(bag):
    assert_warns_at_its_line(lambda: open_bag(bag, cache_time=10))


@pytest.mark.parametrize('look_up', [
    lambda tree, *frames: tree.lookup_many(*frames, [BEGIN], outside='mask'),
    lambda tree, *frames: trajectory(tree, *frames, [BEGIN])])
def test_stamps_in_another_unit_are_warned_of_where_a_bag_is_looked_up(bag, look_up):
    recording = open_bag(bag)
    edge = next(edge for edge in recording.edges() if not edge.static)
    assert_warns_at_its_line(look_up, recording, edge.parent, edge.child)


def test_joint_states_are_warned_of_where_they_are_given():
    states = [JointState(1, ['x'], [1.0])]
    assert_warns_at_its_line(lambda: joint_tracks(ROBOT, states))


def test_observations_in_another_unit_are_warned_of_where_they_are_given():
    given = scene(count=20)
    seconds = given.observations.stamps // SECOND
    with pytest.warns(TransformWarning) as caught, pytest.raises(CalibrationError):
        calibrate(given.buffer, EDGE, replace(given.observations, stamps=seconds))
    assert {one.filename for one in caught} == {__file__}


def test_rosbags_without_a_limit_is_warned_of_where_the_package_is_imported(monkeypatch):
    monkeypatch.delattr(rosbags_file.storage_mcap, 'DECOMPRESSORS')
    spec = util.spec_from_file_location(f'{rosbags_file.__name__}_again', rosbags_file.__file__)
    twin = util.module_from_spec(spec)
    assert_warns_at_its_line(lambda: spec.loader.exec_module(twin))
