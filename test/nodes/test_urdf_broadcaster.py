# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Joint states in, transforms out: in this process, and from a separate one."""

from contextlib import contextmanager
from itertools import count, repeat
from math import cos, sin
from pathlib import Path
import threading
import time

from programs import PATIENCE_S
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy
from ros_helpers import until, until_subscribed
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf_tree_py import Buffer, TransformListener
from tf_tree_py.core import Pose
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.five_frame_motion import FiveFrameMotion
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.nodes.urdf_broadcaster import NAME, SETTINGS, UrdfBroadcaster
from tf_tree_py.ros.messages.convert import time_message
from tf_tree_py.ros.topics.qos import static_listener_qos
import yaml

CONFIG = Path(__file__).parents[2] / 'config' / 'five_frames.urdf'
MS = 1_000_000
NOW = 1_000 * from_seconds(1.0)
ARM = """<robot name="arm">
<link name="a"/><link name="b"/><link name="c"/><link name="tool"/>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/></joint>
<joint name="k" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/></joint>
<joint name="t" type="fixed"><parent link="c"/><child link="tool"/><origin xyz="2 0 0"/></joint>
</robot>"""


@pytest.fixture
def encoders(context):
    """Return a function that publishes joint states, once there is a subscription."""
    node = Node('encoders', context=context)
    publisher = node.create_publisher(JointState, 'joint_states', 10)

    def publish(stamp=NOW, **positions):
        until(publisher.get_subscription_count)
        message = JointState(name=list(positions), position=list(map(float, positions.values())))
        message.header.stamp = time_message(stamp)
        publisher.publish(message)

    publish.publisher = publisher
    yield publish
    node.destroy_node()


@contextmanager
def broadcasting(context, urdf=None, **parameters):
    """Run the node, once its existing subscribers are connected."""
    node = UrdfBroadcaster(urdf, context=context, parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])
    until_subscribed(node)
    with spun_in_background(node):
        yield node


def until_heard(encoders, buffer, stamps, **positions):
    """
    Publish to another process until connected in both directions.

    Neither sensors nor transforms repeat messages that were lost before the discovery.
    """
    def heard():
        encoders(next(stamps), **positions)
        return {'a', 'tool'} <= set(buffer.frames())

    until(heard)


def set_to(node, **values):
    return node.set_parameters([Parameter(name, value=value) for name, value in values.items()])


def test_joint_states_move_the_tree_and_what_is_fixed_comes_once(
        context, encoders, buffer, recorded):
    with broadcasting(context, robot_description=ARM):
        encoders(j=1.0, k=0.5)
        pose = buffer.lookup_within(PATIENCE_S, 'a', 'tool', NOW)
        assert pose == pytest.approx(Pose(1.0) @ Pose.from_xyz_rpy(yaw=0.5) @ Pose(2.0))
        encoders(NOW + 100 * MS, j=2.0, k=0.5)
        buffer.lookup_within(PATIENCE_S, 'a', 'tool', NOW + 100 * MS)
        # The recorder has a thread of its own.
        until(lambda: len(recorded['/tf']) == 2 and recorded['/tf_static'])
    assert [len(message) for message in recorded['/tf_static']] == [1]
    assert [[sample.child for sample in message]
            for message in recorded['/tf']] == [['b', 'c']] * 2


def test_messages_have_tf2s_quaternions(context, encoders, recorded):
    with broadcasting(context, robot_description=ARM):
        encoders(k=-2.5)
        until(lambda: recorded['/tf'])
    # Of the two quaternions of this rotation, the one whose greatest component is positive.
    assert recorded['/tf'][0][0].pose == pytest.approx(Pose(qz=sin(1.25), qw=-cos(1.25)))


def test_parts_come_from_several_publishers_and_what_is_missing_stays(context, encoders, buffer):
    with broadcasting(context, robot_description=ARM):
        encoders(j=1.0)
        encoders(NOW + 5 * MS, k=0.0)
        # j was reported only once: its value stays, and is sent with later ones.
        assert buffer.lookup_within(PATIENCE_S, 'a', 'tool', NOW + 5 * MS) == Pose(3.0)


def test_joints_go_out_no_more_often_than_the_frequency(context, encoders, recorded):
    with broadcasting(context, robot_description=ARM, publish_frequency=100.0) as node:
        for ms in range(0, 40, 4):
            encoders(NOW + ms * MS, j=0.0)
        until(lambda: len(recorded['/tf']) == 4)
        assert [(message[0].stamp - NOW) // MS for message in recorded['/tf']] == [0, 12, 24, 36]
        assert set_to(node, ignore_timestamp=True)[0].successful
        # The known joints are sent again at once; and stamps may now repeat.
        for _ in range(3):
            encoders(NOW + 40 * MS, j=0.0)
        until(lambda: len(recorded['/tf']) == 8)


def test_one_line_changes_every_lookup_and_nothing_else_does(context, encoders, buffer):
    with broadcasting(context, robot_description=ARM) as node:
        encoders(j=1.0, k=0.0)
        assert buffer.lookup_within(PATIENCE_S, 'a', 'tool', NOW) == Pose(3.0)
        edited = ARM.replace('<child link="b"/>', '<child link="b"/><origin xyz="0 5 0"/>')
        assert set_to(node, robot_description=edited)[0].successful
        # No joint state arrived: the last one is sent again, with the new description.
        assert buffer.lookup_within(PATIENCE_S, 'a', 'tool', NOW + 1) == Pose(3.0, 5.0)
        assert buffer.lookup('a', 'tool', NOW) == Pose(3.0)
        edited = edited.replace('xyz="2 0 0"', 'xyz="4 0 0"')
        assert set_to(node, robot_description=edited)[0].successful
        until(lambda: buffer.lookup('a', 'tool', NOW + 1) == Pose(5.0, 5.0))


def test_description_that_is_wrong_is_refused_and_the_robot_stays(context, encoders, buffer):
    with broadcasting(context, robot_description=ARM) as node:
        result, = set_to(node, robot_description=ARM.replace('link="a"', 'link="x"'))
        assert not result.successful
        assert "line 3: joint 'j': its parent 'x' is not a link" in result.reason
        assert not set_to(node, robot_description=' ')[0].successful
        assert not set_to(node, publish_frequency=-1.0)[0].successful
        assert node.get_parameter('robot_description').value == ARM
        encoders(j=1.0, k=0.0)
        assert buffer.lookup_within(PATIENCE_S, 'a', 'tool', NOW) == Pose(3.0)


def test_prefix_goes_before_every_frame_and_can_change(context, encoders, recorded):
    with broadcasting(context, robot_description=ARM, frame_prefix='/r1/') as node:
        encoders(j=0.0)
        until(lambda: recorded['/tf'] and recorded['/tf_static'])
        assert recorded['/tf'][0][0][:2] == ('r1/a', 'r1/b')
        assert recorded['/tf_static'][0][0][:2] == ('r1/c', 'r1/tool')
        assert set_to(node, frame_prefix='r2/')[0].successful
        until(lambda: len(recorded['/tf_static']) == 2)
        # Later subscribers get the current frames.
        assert [sample[:2] for sample in recorded['/tf_static'][1]] == [('r2/c', 'r2/tool')]


def test_description_is_latched_for_rviz(context, buffer):
    heard, came = [], threading.Event()
    node = Node('rviz', context=context)
    qos = static_listener_qos()
    assert qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    with broadcasting(context, robot_description=ARM):
        node.create_subscription(
            String, 'robot_description', lambda text: (heard.append(text.data), came.set()), qos)
        with spun_in_background(node):
            assert came.wait(PATIENCE_S)
    assert heard == [ARM]


def test_without_a_robot_there_is_one_sentence(context, tmp_path):
    for urdf, parameters, told in (
            (None, {}, 'no robot is given: set --urdf FILE, or the parameter'),
            (str(tmp_path / 'no.urdf'), {}, 'no.urdf cannot be read: No such file'),
            (str(CONFIG), {'robot_description': ARM}, 'not both'),
            (None, {'robot_description': '<robot/>'}, 'parameter robot_description, line 1: '),
            (None, {'robot_description': '/opt/arm.urdf'}, 'not the text of a URDF; if it is a '
             'file, give --urdf FILE'),
            (None, {'robot_description': ARM, 'publish_frequency': -1.0}, 'must be a number')):
        with pytest.raises(BadInput, match=told):
            UrdfBroadcaster(urdf, context=context, parameter_overrides=[
                Parameter(name, value=value) for name, value in parameters.items()])


def test_program_watches_its_file(start, encoders, buffer, tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_text(ARM)
    program = start('urdf_broadcaster', '--urdf', str(path))
    program.wait_for("<Robot 'arm': 4 links on 'a', 2 of 3 joints move>")
    until_heard(encoders, buffer, count(NOW, 50 * MS), j=1.0, k=0.0, knee=1.0)
    assert buffer.lookup('a', 'tool') == Pose(3.0)
    program.wait_for("that this robot does not have: 'knee'. Known: j, k")
    path.write_text(ARM.replace('2 0 0', '2 o 0'))
    program.wait_for("arm.urdf, line 5: joint 't': <origin> has the xyz '2 o 0'")
    # As editors do: another file replaces it.
    other = tmp_path / 'arm.urdf~'
    other.write_text(ARM.replace('2 0 0', '7 0 0'))
    other.rename(path)
    program.wait_for('<Robot', count=2)
    until(lambda: buffer.lookup('a', 'tool') == Pose(8.0))
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output


def test_file_without_its_option_is_taken_with_a_warning(start, buffer, tmp_path):
    path = tmp_path / 'arm.urdf'
    path.write_text(ARM)
    program = start('robot_state_publisher', str(path))
    program.wait_for('is used as the file of the robot, as robot_state_publisher does')
    until(lambda: {'c', 'tool'} <= set(buffer.frames()))
    other = start('robot_state_publisher', '/no/such.urdf', '--ros-args', '-r', '__ns:=/other',
                  '-p', f'robot_description:={ARM!r}')
    other.wait_for("'/no/such.urdf' is ignored: the parameter robot_description")
    other.wait_for('<Robot')
    for each in (program, other):
        each.interrupt()
        assert each.end() == 0


def test_xacro_takes_arguments_and_what_it_includes_is_watched(start, buffer, tmp_path):
    pytest.importorskip('xacro', reason='pip install xacro')
    head = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    tool = tmp_path / 'tool.xacro'
    tool.write_text(f'{head}<joint name="t" type="fixed"><parent link="a"/>'
                    '<child link="$(arg prefix)tool"/><origin xyz="2 0 0"/></joint></robot>')
    arm = tmp_path / 'arm.urdf.xacro'
    arm.write_text(f'{head}<xacro:arg name="prefix" default=""/><link name="a"/>'
                   '<link name="$(arg prefix)tool"/><xacro:include filename="tool.xacro"/>'
                   '</robot>')
    program = start('urdf_broadcaster', '--urdf', str(arm), 'prefix:=left_')
    program.wait_for('<Robot')
    until(lambda: {'a', 'left_tool'} <= set(buffer.frames()))
    tool.write_text(tool.read_text().replace('2 0 0', '7 0 0'))
    until(lambda: buffer.lookup('a', 'left_tool') == Pose(7.0))
    tool.write_text(tool.read_text().replace('7 0 0', '7 0 x'))
    program.wait_for('tool.xacro, line 1: joint')
    program.interrupt()
    assert program.end() == 0


def test_frequency_of_zero_sends_every_joint_state(context, encoders, recorded):
    with broadcasting(context, robot_description=ARM, publish_frequency=0.0):
        for ms in range(3):
            encoders(NOW + ms * MS, j=0.0)
        until(lambda: len(recorded['/tf']) == 3)


def test_joint_states_without_a_stamp_are_of_now_and_told_once(start, encoders, buffer):
    program = start('urdf_broadcaster', '--ros-args', '-p', f'robot_description:={ARM!r}')
    program.wait_for('<Robot')
    for _ in range(2):
        until_heard(encoders, buffer, repeat(0), j=1.0, k=0.0)
    edge, _ = buffer.edges_between('a', 'c')
    assert abs(edge.latest - time.time_ns()) < 60 * from_seconds(1.0)
    program.interrupt()
    assert program.end() == 0
    assert program.output.count('arrive without a stamp') == 1


def test_demo_robot_is_the_five_frames(context, encoders, buffer):
    motion = FiveFrameMotion()
    drift, drive, arm = (pose(NOW) for pose in (
        motion.world_T_odom, motion.odom_T_base_link, motion.base_link_T_gripper))
    positions = {'arm/trans_x': arm.x, 'arm/trans_y': arm.y, 'arm/trans_z': arm.z,
                 'arm/rot_x': arm.qx, 'arm/rot_y': arm.qy, 'arm/rot_z': arm.qz,
                 'arm/rot_w': arm.qw}
    for name, pose in (('drift', drift), ('drive', drive)):
        positions |= {f'{name}/x': pose.x, f'{name}/y': pose.y, f'{name}/theta': pose.as_rpy()[2]}
    with broadcasting(context, str(CONFIG)):
        encoders(**positions)
        world_T_gripper = buffer.lookup_within(PATIENCE_S, 'world', 'gripper', NOW)
    assert world_T_gripper == pytest.approx(motion.world_T_gripper(NOW), abs=1e-12)
    assert buffer.lookup('base_link', 'camera') == pytest.approx(motion.base_link_T_camera)
    assert len(buffer.frames()) == 5


def test_listener_that_comes_late_hears_what_is_fixed(context, encoders, buffer):
    with broadcasting(context, robot_description=ARM):
        late = Buffer()
        node = Node('late', context=context)
        with TransformListener(late, node):
            assert late.lookup_within(PATIENCE_S, 'c', 'tool') == Pose(2.0)
        node.destroy_node()


def test_example_configuration_holds_what_can_be_set_with_its_default():
    config = yaml.safe_load(CONFIG.with_suffix('.yaml').read_text())
    told = {**config['/**']['ros__parameters'], **config[f'/**/{NAME}']['ros__parameters']}
    assert told | {'robot_description': ''} == {
        setting.name: setting.default for setting in SETTINGS}


def test_launch_files_find_it_by_the_name_they_have(start, context, buffer):
    program = start(
        'robot_state_publisher', '--ros-args', '-r', '__ns:=/r1', '-p', 'frame_prefix:=r1/', '-p',
        'publish_frequency:=50', '-p', f'robot_description:={ARM!r}')
    node = Node('looking', context=context)
    until(lambda: ('robot_state_publisher', '/r1') in node.get_node_names_and_namespaces())
    node.destroy_node()
    assert buffer.lookup_within(PATIENCE_S, 'r1/c', 'r1/tool') == Pose(2.0)
    program.interrupt()
    assert program.end() == 0
    assert '[r1.robot_state_publisher]: <Robot' in program.output
