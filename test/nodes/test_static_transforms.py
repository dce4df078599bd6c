# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Static transforms as users write them, correct and wrong; without ROS."""

import math
from pathlib import Path
import sys

import pytest
from tf_tree_py.core import Pose
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.static_transforms import from_words, from_yaml

EXAMPLE = Path(__file__).parents[2] / 'config' / 'static_transforms.yaml'
FRAMES = {'frame_id': 'a', 'child_frame_id': 'b'}


@pytest.mark.parametrize(('words', 'pose'), [
    ({}, Pose()),
    ({'x': 1, 'z': -2.5}, Pose(x=1.0, z=-2.5)),
    ({'qz': 1.0, 'qw': 0.0}, Pose(qz=1.0, qw=0.0)),
    ({'qz': 2.0, 'qw': 2.0}, Pose(qz=math.sqrt(0.5), qw=math.sqrt(0.5))),
    # qw is one by default, as in tf2.
    ({'qx': 1.0}, Pose(qx=math.sqrt(0.5), qw=math.sqrt(0.5))),
    ({'y': 1.0, 'yaw': math.pi}, Pose(y=1.0, qz=1.0, qw=0.0)),
    ({'x': '1e-3'}, Pose(x=1e-3)),
])
def test_what_is_not_given_is_as_in_tf2(words, pose):
    assert from_words({**FRAMES, **words}).pose == pytest.approx(pose, abs=1e-15)


def test_angles_are_about_the_fixed_axes_roll_first():
    pose = from_words({**FRAMES, 'roll': 0.1, 'pitch': 0.2, 'yaw': 0.3}).pose
    assert pose.as_rpy() == pytest.approx((0.1, 0.2, 0.3))


def test_covariance_is_six_variances_or_a_matrix():
    assert from_words(FRAMES).covariance is None
    six = [1e-4, 2e-4, 3e-4, 0, '1e-6', 0.0]
    covariance = from_words({**FRAMES, 'covariance': six}).covariance
    assert covariance.diagonal().tolist() == [1e-4, 2e-4, 3e-4, 0.0, 1e-6, 0.0]
    whole = covariance.ravel().tolist()
    assert from_words({**FRAMES, 'covariance': whole}).covariance.ravel().tolist() == whole


def test_leading_slash_is_stripped_as_listeners_do():
    assert from_words({'frame_id': '/map', 'child_frame_id': '/odom'})[:2] == ('map', 'odom')


@pytest.mark.parametrize(('words', 'message'), [
    ({'frame_id': None}, 'the frame id is missing'),
    ({'child_frame_id': ''}, 'the child frame id is empty'),
    ({'child_frame_id': '/'}, 'the child frame id is empty'),
    ({'child_frame_id': True}, 'the child frame id is True.*quotes'),
    ({'child_frame_id': '/a'}, "both 'a'"),
    ({'x': 'abc'}, "x is 'abc', which is not a finite number"),
    ({'x': math.nan}, 'x is nan'),
    ({'x': True}, 'x is True'),
    ({'x': [1]}, r'x is \[1\]'),
    ({'qw': 0.0}, 'all zero'),
    ({'qx': 0.0, 'roll': 0.0}, 'not both'),
    ({'roll_deg': 5.0}, "'roll_deg' is unknown; use frame_id,"),
    ({'covariance': 0.01}, 'the covariance is 0.01; it must be a list of six variances'),
    ({'covariance': [0.01] * 5}, 'list of six variances'),
    ({'covariance': ['wide'] * 6}, "a number of the covariance is 'wide'"),
    ({'covariance': [-1.0] * 6}, 'variance of x is -1'),
    ({'covariance': [0.0] + [1.0] * 35}, 'not positive semidefinite'),
])
def test_words_that_cannot_be_are_refused(words, message):
    with pytest.raises(BadInput, match=message):
        from_words({**FRAMES, **words})


def test_example_file_is_read():
    transforms = {child: (parent, pose) for parent, child, pose, _ in from_yaml(str(EXAMPLE))}
    assert transforms.keys() == {'camera', 'camera_optical', 'lidar', 'thermal_camera'}
    parent, pose = transforms['camera_optical']
    assert parent == 'camera'
    # The optical axis is the camera's x axis, and the right of the image is the camera's right.
    assert pose @ (0.0, 0.0, 1.0) == pytest.approx((1.0, 0.0, 0.0), abs=1e-15)
    assert pose @ (1.0, 0.0, 0.0) == pytest.approx((0.0, -1.0, 0.0), abs=1e-15)


@pytest.mark.parametrize(('text', 'message'), [
    ('', 'must contain a list named transforms'),
    ('transforms: []', 'must contain a list'),
    ('transforms: {a: b}', 'must contain a list'),
    ('- {frame_id: a, child_frame_id: b}', 'must contain a list named'),
    ('transforms: [{frame_id: a, child_frame_id: b}]\nmore: 1', 'and nothing else'),
    ('transforms: [3]', 'transform 1: 3 must be keys and values'),
    ('transforms: [{frame_id: a, child_frame_id: b}, {frame_id: a}]',
     'transform 2: the child frame id is missing'),
    ('transforms: [{frame_id: a, child_frame_id: b, roll_deg: 1}]', "'roll_deg' is unknown"),
    ('transforms: [{frame_id: a, child_frame_id: b}, {frame_id: c, child_frame_id: b}]',
     "'b' appears twice, under 'a' and under 'c'"),
    ('transforms: [{frame_id: a, child_frame_id: b}, {frame_id: b, child_frame_id: a}]',
     "'b' -> 'a' would close a loop"),
    ('transforms: [', 'is not YAML: while parsing'),
])
def test_file_that_cannot_be_is_refused(tmp_path, text, message):
    path = tmp_path / 'wrong.yaml'
    path.write_text(text)
    with pytest.raises(BadInput, match=message) as refused:
        from_yaml(str(path))
    assert str(refused.value).startswith(str(path))
    assert '\n' not in str(refused.value)


def test_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / 'binary.yaml'
    path.write_bytes(b'\xff\xfe\x00')
    with pytest.raises(BadInput, match='is not YAML'):
        from_yaml(str(path))


def test_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(BadInput, match='cannot be read: No such file'):
        from_yaml(str(tmp_path / 'nowhere.yaml'))


def test_yaml_is_needed_for_files_alone(monkeypatch):
    monkeypatch.setitem(sys.modules, 'yaml', None)
    assert from_words(FRAMES).pose == Pose()
    with pytest.raises(BadInput, match='needs PyYAML: apt install python3-yaml'):
        from_yaml(str(EXAMPLE))
