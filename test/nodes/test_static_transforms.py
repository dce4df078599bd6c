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
    ({'x': '1_0'}, "x is '1_0'"),
    ({'x': 10**400}, 'x is 1000'),
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
    ('[' * 3000, 'is not YAML: maximum recursion depth'),
    ('transforms: [{x: !!int 1.5}]', 'is not YAML: invalid literal'),
])
def test_file_that_cannot_be_is_refused(tmp_path, text, message):
    path = tmp_path / 'wrong.yaml'
    path.write_text(text)
    with pytest.raises(BadInput, match=message) as refused:
        from_yaml(str(path))
    assert str(refused.value).startswith(str(path))
    assert '\n' not in str(refused.value)


def written(tmp_path, lines):
    """Return the path of a file with one transform, which begins in line 2."""
    path = tmp_path / 'written.yaml'
    path.write_text('transforms:\n  - frame_id: a\n    child_frame_id: b\n' + ''.join(
        f'    {line}\n' for line in lines), encoding='utf-8')
    return str(path)


@pytest.mark.parametrize(('text', 'number'), [
    ('0', 0.0), ('-7', -7.0), ('+1.5', 1.5), ('.5', 0.5), ('1.', 1.0), ('01.5', 1.5),
    ('1e3', 1e3), ('-1e-3', -1e-3), ('2.5E+3', 2500.0), ('"1.5"', 1.5), ('007', 7.0),
    ('1 # metre', 1.0),
])
def test_decimal_number_may_be_written_in_any_way(tmp_path, text, number):
    [transform] = from_yaml(written(tmp_path, [f'x: {text}']))
    assert transform.pose.x == number


@pytest.mark.parametrize(('text', 'reading', 'fix'), [
    ('1:30', '90', 'write 90 if that is meant, and otherwise an ordinary decimal number'),
    ('1:30.5', '90.5', 'write 90.5 if'),
    ('010', '8', 'write 8 if that is meant, and otherwise an .* number, such as 10$'),
    ('-010', '-8', 'such as -10$'),
    ('0x10', '16', 'write 16 if'),
    ('0b11', '3', 'write 3 if'),
    ('1_000', '1000', 'write 1000 if'),
    ('yes', 'true', 'write an ordinary decimal number, such as 0.25$'),
    ('.inf', 'inf', 'write an ordinary'),
    ('.nan', 'nan', 'write an ordinary'),
    ('~', 'nothing', 'write an ordinary'),
    ('2026-13-99', 'a date', 'write an ordinary'),
    ('0.5.', 'a string', 'write an ordinary'),
    ('15deg', 'a string', 'write an ordinary'),
])
@pytest.mark.parametrize(('word', 'line'), [
    ('yaw', 'yaw: {}'), ('a number of the covariance', 'covariance: [1, 1, 1, 1, {}, 1]')])
def test_what_yaml_would_change_into_another_number_is_refused(
        tmp_path, word, line, text, reading, fix):
    path = written(tmp_path, ['z: 1.0', line.format(text)])
    with pytest.raises(BadInput, match=fix) as refused:
        from_yaml(path)
    assert str(refused.value).startswith(
        f"{path}, line 5: {word} is '{text}', which YAML reads as {reading}; ")


@pytest.mark.parametrize(('name', 'reading'), [
    ('010', '8'), ('on', 'true'), ('1.0', '1.0'), ('2026-13-99', 'a date')])
def test_frame_that_yaml_does_not_read_as_a_string_is_refused(tmp_path, name, reading):
    path = tmp_path / 'names.yaml'
    path.write_text(f'transforms:\n- {{frame_id: map,\n   child_frame_id: {name}}}')
    with pytest.raises(BadInput) as refused:
        from_yaml(str(path))
    assert str(refused.value) == (f"{path}, line 3: child_frame_id is '{name}', which YAML reads "
                                  f'as {reading}; enclose it in quotes: "{name}"')
    path.write_text(path.read_text().replace(name, f'"{name}"'))
    assert from_yaml(str(path))[0].child == name


@pytest.mark.parametrize(('lines', 'error'), [
    (['x: 1', 'y: 0', '"x": 2'],
     "line 6: x is given twice, in line 4 as '1' and in line 6 as '2'"),
    (['x: 1', 'x: 1'], "line 5: x is given twice, in line 4 as '1' and in line 5 as '1'"),
    (['child_frame_id: b'], 'line 4: child_frame_id is given twice, in line 3 '),
    (['covariance: {a: 1, a: 2}'], 'line 4: a is given twice'),
])
def test_key_that_is_given_twice_is_refused_at_any_level(tmp_path, lines, error):
    path = written(tmp_path, lines)
    with pytest.raises(BadInput) as refused:
        from_yaml(path)
    assert str(refused.value).startswith(f'{path}, {error}')
    assert str(refused.value).endswith(
        ', of which YAML would use only the last; remove one of the two')


def test_second_list_of_transforms_is_refused(tmp_path):
    path = tmp_path / 'two.yaml'
    path.write_text(2 * 'transforms:\n  - {frame_id: a, child_frame_id: b}\n')
    with pytest.raises(BadInput, match='line 3: transforms is given twice, in line 1 and in line '
                       '3, of which .* the last; remove one of the two, or join them'):
        from_yaml(str(path))


def test_merged_keys_are_not_given_twice(tmp_path):
    path = tmp_path / 'merged.yaml'
    path.write_text("""transforms:
  - &left {frame_id: base, child_frame_id: left, x: 1.0, y: 2.0}
  - &tilted {frame_id: base, child_frame_id: tilted, pitch: 0.5}
  - {<<: *left, <<: *tilted, child_frame_id: right, y: -2.0}
""")
    right = from_yaml(str(path))[-1]
    assert right.pose == pytest.approx(Pose.from_xyz_rpy(1.0, -2.0, pitch=0.5))


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
