# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command tf_calibrate: its verdict on bags, its files, its JSON and its errors."""

import json

from bags import file_of, JAZZY, LATCHED, Message, SECOND, without_index, write_ros2
from calibration_scenes import EDGE, errors, scene, START, with_target_moved
import numpy as np
import pytest
from tf_tree_py.bag import open_bag
from tf_tree_py.bag.files.connections import typestore
from tf_tree_py.calibration import Observations, recorded_observations
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core import Pose
from tf_tree_py.nodes.static_transforms import from_yaml
from tf_tree_py.tools.calibrate.urdf_origin import write_origin
from tf_tree_py.urdf import Robot
from tool_helpers import assert_shape, tool

ASK = ['--edge', *EDGE, '--observations', '/target', '--fixed-in', 'map', '--max-offset', '0.2']
URDF = """<?xml version="1.0"?>
<!-- a robot -->
<robot name="cart">
  <link name="base"/><link name="camera"/><link name="lidar"/>
  <joint name="lens" type="fixed">
    <parent link="base"/>  <child link="camera"/>
    <origin rpy='0 0 0'   xyz="0.2 0 0.5"  /> <!-- by eye -->
  </joint>
  <joint name="top" type="fixed"><parent link="base"/><child link="lidar"/></joint>
</robot>
"""
JAZZY.register({name: fields for name, fields in typestore(False).fielddefs.items()
                if name not in JAZZY.fielddefs})
TYPES = JAZZY.types


def header(stamp, frame='camera'):
    return TYPES['std_msgs/msg/Header'](
        TYPES['builtin_interfaces/msg/Time'](*divmod(int(stamp), SECOND)), frame)


def pose_of(numbers):
    return TYPES['geometry_msgs/msg/Pose'](
        TYPES['geometry_msgs/msg/Point'](*numbers[:3]),
        TYPES['geometry_msgs/msg/Quaternion'](*numbers[3:]))


def uncertain(numbers):
    return TYPES['geometry_msgs/msg/PoseWithCovariance'](
        pose_of(numbers), np.diag([4e-6] * 6).ravel())


def pose_stamped(stamp, numbers):
    return TYPES['geometry_msgs/msg/PoseStamped'](header(stamp), pose_of(numbers))


def pose_with_covariance(stamp, numbers):
    return TYPES['geometry_msgs/msg/PoseWithCovarianceStamped'](header(stamp), uncertain(numbers))


def pose_array(stamp, numbers):
    return TYPES['geometry_msgs/msg/PoseArray'](header(stamp), [pose_of(numbers)])


def point(stamp, numbers):
    return TYPES['geometry_msgs/msg/PointStamped'](
        header(stamp), TYPES['geometry_msgs/msg/Point'](*numbers[:3]))


def detection(stamp, numbers):
    hypothesis = TYPES['vision_msgs/msg/ObjectHypothesisWithPose'](
        TYPES['vision_msgs/msg/ObjectHypothesis']('pallet', 0.9), uncertain(numbers))
    box = TYPES['vision_msgs/msg/BoundingBox3D'](
        pose_of(numbers), TYPES['geometry_msgs/msg/Vector3'](1.0, 1.0, 1.0))
    return TYPES['vision_msgs/msg/Detection3D'](header(stamp), [hypothesis], box, 'pallet')


def detections(stamp, numbers):
    return TYPES['vision_msgs/msg/Detection3DArray'](header(stamp), [detection(stamp, numbers)])


def tags(stamp, numbers):
    tag = TYPES['apriltag_ros/msg/AprilTagDetection'](
        np.array([7], dtype=np.int32), np.array([0.1]), pose_with_covariance(stamp, numbers))
    return TYPES['apriltag_ros/msg/AprilTagDetectionArray'](header(stamp), [tag])


def bag_of(path, given, make=pose_stamped):
    """Write a scene as a bag, with its observations on /target."""
    buffer, stamps = given.buffer, given.buffer.stamps_of('base')
    messages = [Message(START, '/tf_static', [(*EDGE, 0, tuple(buffer.lookup(*EDGE)))], LATCHED)]
    messages += [Message(stamp, '/tf', [('map', 'base', stamp, tuple(pose))]) for stamp, pose in
                 zip(stamps.tolist(), buffer.lookup_many('map', 'base', stamps).tolist(),
                     strict=True)]
    for stamp, seen in zip(given.observations.stamps.tolist(), given.observations.seen.tolist(),
                           strict=True):
        message = make(stamp, seen)
        messages.append(Message(stamp + 1, '/target', [], '', '', message.__msgtype__, bytes(
            JAZZY.serialize_cdr(message, message.__msgtype__))))
    return write_ros2(path, sorted(messages, key=lambda message: message.received))


@pytest.fixture(scope='module')
def given():
    return scene(1, 80, duration_s=8.0)


@pytest.fixture(scope='module')
def bag(tmp_path_factory, given):
    return bag_of(tmp_path_factory.mktemp('calibrate') / 'run', given)


def test_verdict_edge_and_files_of_a_bag(bag, given, tmp_path):
    pytest.importorskip('matplotlib')
    robot = tmp_path / 'robot.urdf'
    robot.write_text(URDF)
    done = tool('tf_calibrate', '--bag', bag, *ASK, '--time', '--json', '--write', robot,
                '-o', tmp_path / 'edge.yaml', '-o', tmp_path / 'all.json',
                '-o', tmp_path / 'off.png')
    assert done.returncode == 1, done.stderr
    found = json.loads(done.stdout)
    assert_shape(found, 'calibration', '### `tf_calibrate --json`')
    assert found == json.loads((tmp_path / 'all.json').read_text())
    assert found['verdict'] == 'edge and time' and found['observations'] > 60
    assert abs(found['time_offset_s'] - 0.08) < 0.002
    after = list(found['edge']['after'].values())
    assert np.abs(errors(after, given.true)).max() < 0.003

    [published] = from_yaml(str(tmp_path / 'edge.yaml'))
    assert (published.parent, published.child) == EDGE
    assert np.abs(errors(published.pose, after)).max() < 1e-9
    np.testing.assert_allclose(published.covariance, found['edge']['covariance'], rtol=1e-6)

    assert (tmp_path / 'robot.urdf.bak').read_text() == URDF
    [line] = [number for number, (old, new) in enumerate(zip(
        URDF.splitlines(), robot.read_text().splitlines(), strict=True)) if old != new]
    assert line == 6 and robot.read_text().splitlines()[line].endswith('  /> <!-- by eye -->')
    [lens] = [joint for joint in Robot.parse(robot.read_text()).joints if joint.name == 'lens']
    assert np.abs(errors(lens.origin, after)).max() < 1e-8
    assert 'line 7' in done.stderr and 'wrote' in done.stderr
    assert (tmp_path / 'off.png').stat().st_size > 10_000


def test_report_keeps_an_edge_that_compensates_for_stamps(bag, tmp_path):
    robot = tmp_path / 'robot.urdf'
    robot.write_text(URDF)
    done = tool('tf_calibrate', '--bag', bag, *ASK, '--write', robot)
    assert done.returncode == 1
    assert 'robot.urdf is unchanged, because the stamps are wrong, too' in done.stderr
    assert robot.read_text() == URDF and list(tmp_path.iterdir()) == [robot]
    assert done.stdout.startswith('edge and time: The mounting is wrong, and the')
    assert 'add --time' in done.stdout and 'error left, mm' in done.stdout
    assert 'base -> camera' in done.stdout and '--write' not in done.stdout


def test_target_that_moves_gets_no_edge(tmp_path, given):
    robot, edge, picture = (tmp_path / name for name in ('robot.urdf', 'edge.yaml', 'off.svg'))
    robot.write_text(URDF)
    moving = given._replace(observations=with_target_moved(
        given, lambda seconds: seconds[:, None] * [0.0, 0.15, 0.0]))
    done = tool('tf_calibrate', '--bag', bag_of(tmp_path / 'run', moving), *ASK, '--time',
                '--write', robot, '-o', edge, '-o', picture)
    assert done.returncode == 1, done.stderr
    why = "the observations do not fit one target at rest: '/target' moves in map"
    assert done.stdout.startswith('cannot tell: The observations do not fit one target at rest')
    assert why in ' '.join(done.stdout.split()) and 'fasten the target' in done.stdout
    assert '--write' not in done.stdout and 'not seen' not in done.stdout
    assert f'robot.urdf is unchanged, because {why}' in done.stderr
    assert f'edge.yaml is not written, because there is no estimate: {why}' in done.stderr
    assert robot.read_text() == URDF and not edge.exists() and picture.exists()
    done = tool('tf_calibrate', '--bag', tmp_path / 'run', *ASK, '--json')
    found = json.loads(done.stdout)
    assert_shape(found, 'calibration', '### `tf_calibrate --json`')
    assert found['contradiction']['what'].startswith(why)
    assert found['edge']['after'] == pytest.approx(found['edge']['before'])


def test_xacro_beside_an_origin_is_no_obstacle(tmp_path):
    robot = tmp_path / 'robot.urdf.xacro'
    robot.write_text(URDF.replace('<!-- by', '<xacro:insert_block name="inertia"/> <!-- by'))
    assert write_origin(robot, *EDGE, Pose(x=0.1)).line == 7


def test_robot_without_an_origin_gets_one(tmp_path):
    robot = tmp_path / 'robot.urdf'
    robot.write_text(URDF)
    wanted = Pose.from_xyz_rpy(x=0.1, z=1e-7, yaw=-2.0)
    first = write_origin(robot, 'base', 'lidar', wanted)
    again = write_origin(robot, 'base', 'lidar', wanted)
    assert first.backup != again.backup and again.before == again.after
    [top] = [joint for joint in Robot.parse(robot.read_text()).joints if joint.name == 'top']
    assert np.abs(errors(top.origin, wanted)).max() < 1e-8
    assert robot.read_text().count('<origin') == 2


@pytest.mark.parametrize('text, edge, sentence', [
    (URDF, ('base', 'hand'), 'no joint with the parent base and the child hand'),
    (URDF.replace('"fixed"', '"revolute"'), EDGE, "of the type 'revolute', not fixed"),
    (URDF.replace('0.2 0', '${x} 0'), EDGE, 'line 7: xacro computes this origin'),
    (URDF.replace('name="top"', 'name="two"').replace('"lidar"/></', '"camera"/></'), EDGE,
     'several joints between base and camera, in the lines 5, 9: edit'),
    (URDF.replace('<origin', '&o;<!-- ').replace('0.5"  />', '-->').replace(
        '<!-- a robot -->', '<!DOCTYPE robot [<!ENTITY o "<origin/>">]>'), EDGE,
     'line 7: an entity contains this origin'),
    (URDF.replace('<origin', '<xacro:if value="1"><origin').replace(
        '0.5"  />', '0.5"/></xacro:if>'), EDGE,
     'line 7: this joint may have another origin, or get it from xacro'),
    (URDF.replace('<!-- by', '<xacro:if value="1"><origin/></xacro:if> <!-- by'), EDGE,
     'line 7: this joint may have another origin'),
    (URDF.replace('<origin', '<xacro:insert_block name="origin"/> <!--').replace(
        '0.5"  />', '-->'), EDGE,
     'line 7: this joint may have another origin'),
    (URDF.replace('<!-- by', '<origin/> <!-- by'), EDGE,
     'line 7: this joint may have another origin'),
    (URDF[:-10], EDGE, 'is not a URDF'), (None, EDGE, 'cannot be read')])
def test_description_that_cannot_be_changed_stays(tmp_path, text, edge, sentence):
    robot = tmp_path / 'robot.urdf'
    if text is not None:
        robot.write_text(text)
    with pytest.raises(Cannot, match=sentence.replace('(', r'\(')):
        write_origin(robot, *edge, Pose())
    assert text is None or robot.read_text() == text
    assert len(list(tmp_path.iterdir())) == (text is not None)


@pytest.mark.parametrize('encoding', ['utf-16', 'utf-16-be'])
def test_description_that_is_not_utf_8_stays(tmp_path, encoding):
    robot = tmp_path / 'robot.urdf'
    robot.write_bytes(URDF.encode(encoding))
    with pytest.raises(Cannot, match='is not UTF-8: convert it first'):
        write_origin(robot, *EDGE, Pose())
    assert robot.read_bytes() == URDF.encode(encoding)


def test_only_the_attributes_of_the_origin_change(tmp_path):
    robot = tmp_path / 'robot.urdf'
    robot.write_text(URDF.replace("rpy='0 0 0'", """my-xyz="1" a.rpy='2' note="xyz='3'" """))
    write_origin(robot, *EDGE, Pose(x=0.1))
    assert ("""<origin rpy="0 0 0" my-xyz="1" a.rpy='2' note="xyz='3'"    xyz="0.1 0 0"  />"""
            in robot.read_text())


@pytest.mark.parametrize('begin, end', [
    ('<xacro:if value="1">', '</xacro:if>'),
    ('<xacro:macro name="m"><xacro:unless value="0">', '</xacro:unless></xacro:macro>')])
def test_joint_in_a_condition_or_macro_of_xacro_is_found(tmp_path, begin, end):
    robot = tmp_path / 'robot.urdf.xacro'
    text = URDF.replace('<joint', begin + '<joint', 1).replace('</joint>', '</joint>' + end, 1)
    robot.write_text(text)
    write_origin(robot, *EDGE, Pose(x=0.1))
    assert robot.read_text() == text.replace("rpy='0 0 0'   xyz=\"0.2 0 0.5\"",
                                             'rpy="0 0 0"   xyz="0.1 0 0"')


@pytest.mark.parametrize('make, target', [
    (pose_stamped, '/target'), (pose_with_covariance, '/target'), (pose_array, '/target'),
    (point, '/target'), (detection, 'pallet'), (detections, 'pallet'), (tags, 'tag 7')])
def test_every_type_of_message_is_read(tmp_path, given, make, target):
    few = given._replace(observations=Observations(
        'camera', given.observations.stamps[:3], given.observations.seen[:3], 'map'))
    recording = open_bag(bag_of(tmp_path / 'run', few, make))
    [found] = recorded_observations(recording, ['/target'], 'map', {})
    assert (found.sensor, found.target, found.fixed_in) == ('camera', target, 'map')
    assert found.stamps.tolist() == few.observations.stamps.tolist()
    np.testing.assert_allclose(
        found.seen, few.observations.seen[:, :found.seen.shape[1]], atol=1e-12)
    assert (found.covariances is not None) == (
        make in (pose_with_covariance, detection, detections, tags))
    [known] = recorded_observations(recording, ['/target'], 'map', {target: 'pallet_1'})
    assert known.fixed_in == 'pallet_1' and not known.place[:3].any()


def test_frame_of_a_tag_on_tf_is_an_observation(given):
    for stamp, pose in zip(given.observations.stamps.tolist(), given.observations.seen.tolist(),
                           strict=True):
        given.buffer.insert('camera', 'tag_7', stamp, pose)
    [found] = recorded_observations(given.buffer.snapshot(), ['tf:tag_7'], 'map', {})
    assert (found.sensor, found.target) == ('camera', 'tag_7')
    assert found.stamps.tolist() == given.observations.stamps.tolist()
    np.testing.assert_allclose(found.seen[:, :3], given.observations.seen[:, :3], atol=1e-12)


def test_bag_that_was_cut_short_is_used_as_far_as_it_goes(tmp_path, given):
    path = without_index(file_of(bag_of(tmp_path / 'run', given)))
    done = tool('tf_calibrate', '--bag', path, *ASK, '--time', '--json')
    assert done.returncode == 1 and json.loads(done.stdout)['verdict'] == 'edge and time'
    assert 'damaged file' in done.stderr


@pytest.mark.parametrize('arguments, sentence', [
    (['--observations', '/tf'], 'tf2_msgs/msg/TFMessage carries no observations'),
    (['--observations', '/nothing'], 'has no topic /nothing; it has: '),
    (['--observations', 'tf:tag_9'], "the frame 'tag_9' was never seen"),
    (['--observations', 'tf:camera'], 'base -> camera is static'),
    (['--observations', '/target', '--edge', 'map', 'base'], 'the edge map -> base moves'),
    (['--observations', '/target', '--fixed-in', 'world'], "the target rests in 'world'"),
    (['--observations', '/target', '-o', 'edge.txt'], "'edge.txt' has none of the suffixes"),
    (['--observations', '/target', '--seconds', '3'], '--seconds is for a live system'),
    (['--observations', '/target', '--fleet', 'tcp/x:1'], 'cannot be used together'),
    (['--observations', '/target', '--write', 'no.urdf'], 'no.urdf cannot be read')])
def test_what_cannot_be_done_is_one_sentence(bag, arguments, sentence):
    words = ['--edge', *EDGE] if '--edge' not in arguments else []
    words += ['--fixed-in', 'map'] if '--fixed-in' not in arguments else []
    done = tool('tf_calibrate', '--bag', bag, *words, *arguments)
    assert done.returncode == 2
    [line] = done.stderr.splitlines()
    assert line.startswith('tf_calibrate: ') and sentence in line
