# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The content of a description: the edges, their motion, and the shapes of links."""

from math import cos, pi, sin

from descriptions import chain, joint, parsed
import numpy as np
import pytest
from tf_tree_py.core import InvalidArgumentException, Pose
from tf_tree_py.core.geometry import se3
from tf_tree_py.urdf import Box, Cylinder, Mesh, Robot, Sphere, Visual

ORIGIN = {'xyz': '1 2 3', 'rpy': '0.1 0.2 0.3'}
AT_ORIGIN = Pose.from_xyz_rpy(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)


def moved(joint_type, positions, axis=None, **named):
    """Return the pose of a joint of a kind, relative to its origin."""
    robot = parsed(joint('j', joint_type, 'a', 'b', axis=axis, **ORIGIN))
    given = dict(zip(robot.variables, positions, strict=True)) if positions else named
    return AT_ORIGIN.inverse() @ Pose(*robot.edges(given)['a', 'b'].tolist())


def near(pose, **parts):
    return pose == pytest.approx(Pose.from_xyz_rpy(**parts), abs=1e-15)


@pytest.mark.parametrize('joint_type', ['revolute', 'continuous'])
def test_turning_joint_turns_about_its_axis(joint_type):
    assert near(moved(joint_type, [0.7], '0 0 2'), yaw=0.7)
    assert near(moved(joint_type, [0.7], '0 -1 0'), pitch=-0.7)
    assert near(moved(joint_type, [0.7]), roll=0.7)


def test_sliding_joint_slides_along_its_axis():
    assert near(moved('prismatic', [0.5], '0 3 4'), y=0.3, z=0.4)


def test_planar_joint_slides_in_its_plane_and_turns_about_its_normal():
    assert near(moved('planar', [1.0, 2.0, 0.5], '0 0 1'), x=1.0, y=2.0, yaw=0.5)
    assert near(moved('planar', [1.0, 2.0, 0.5]), x=1.0, y=2.0, yaw=0.5)
    # The smallest rotation from z to x takes x to -z.
    assert near(moved('planar', [1.0, 2.0, 0.5], '1 0 0'), z=-1.0, y=2.0, roll=0.5)
    assert near(moved('planar', [1.0, 2.0, 0.5], '0 0 -1'), x=1.0, y=-2.0, yaw=-0.5)


def test_floating_joint_is_where_it_is_said_to_be():
    pose = moved('floating', [1.0, 2.0, 3.0, 0.0, 0.0, 2 * sin(0.2), 2 * cos(0.2)])
    assert near(pose, x=1.0, y=2.0, z=3.0, yaw=0.4)
    assert near(moved('floating', [], **{'j/trans_z': 1.0}), z=1.0)


def test_mimic_follows_through_others_unless_it_is_given_itself():
    robot = parsed(
        joint('lead', 'prismatic', 'a', 'b'),
        joint('second', 'prismatic', 'b', 'c',
              '<mimic joint="third" multiplier="2" offset="1"/>'),
        joint('third', 'prismatic', 'c', 'd', '<mimic joint="lead" multiplier="-1" offset="5"/>'))
    assert robot.variables == ('lead',)

    def slides(**given):
        return [pose[0] for pose in robot.edges(given).values()]

    assert slides() == [0.0, 11.0, 5.0]
    assert slides(lead=2.0) == [2.0, 7.0, 3.0]
    assert slides(lead=2.0, third=10.0) == [2.0, 21.0, 10.0]
    assert slides(second=1.0) == [0.0, 1.0, 5.0]


def test_many_positions_are_each_as_alone():
    robot = Robot.parse(chain(6))
    positions = np.random.default_rng(1).uniform(-3.0, 3.0, (5, 6))
    many = robot.edges(positions)
    for number, row in enumerate(positions):
        for edge, pose in robot.edges(row).items():
            assert pose.shape == (7,)
            assert many[edge][number] == pytest.approx(pose, abs=1e-15)
    by_name = robot.edges(dict(zip(robot.variables, positions.T, strict=True)))
    assert all((by_name[edge] == many[edge]).all() for edge in many)
    assert np.linalg.norm(many['link_0', 'link_1'][:, 3:], axis=1) == pytest.approx(1.0)


def test_fixed_edges_are_there_as_often_as_the_others():
    robot = parsed(joint('f', 'fixed', 'a', 'b', **ORIGIN), joint('j', 'revolute', 'b', 'c'))
    assert robot.edges([[0.0], [1.0]])['a', 'b'] == pytest.approx(np.array([AT_ORIGIN] * 2))
    assert robot.edges()['a', 'b'].tolist() == pytest.approx(AT_ORIGIN)
    assert robot.edges(np.empty((0, 1)))['a', 'b'].shape == (0, 7)
    assert parsed(links='a').edges() == {}


@pytest.mark.parametrize(('given', 'told'), [
    ({'jj': 1.0}, r"'jj' is not a variable of this robot. Did you mean 'j'\? Known: j"),
    ([1.0, 2.0], r'an array \(N, 1\) with a column for each of robot.variables.*not \(2,\)'),
    ('j', 'not'), (0.5, 'not'),
    ({'j': float('nan')}, "a position of 'j' is not finite"),
    ({'j': 'x'}, 'positions are numbers'),
    ({'j': [1.0, 2.0], 'p/x': [1.0, 2.0, 3.0]}, r'same length.*: j \(2,\), p/x \(3'),
    ({'f/rot_w': 0.0}, 'quaternion of a floating joint is zero'),
])
def test_positions_that_are_none_are_told(given, told):
    more = [joint('p', 'planar', 'b', 'c'), joint('f', 'floating', 'c', 'd')]
    robot = parsed(joint('j', 'revolute', 'a', 'b'), *(more if isinstance(given, dict) else ()))
    with pytest.raises(InvalidArgumentException, match=told):
        robot.edges(given)


def test_robot_tells_what_it_is():
    robot = Robot.parse(chain(3))
    assert repr(robot) == "<Robot 'r': 4 links on 'link_0', 3 of 3 joints move>"
    assert robot.root == 'link_0' and robot.variables == ('joint_0', 'joint_1', 'joint_2')


def test_exporters_habits_are_read():
    """Elements of Gazebo and of transmissions, an axis of a fixed joint, a mimic of no joint."""
    robot = Robot.parse("""<?xml version="1.0"?>
<robot name="r" xmlns:gz="http://gazebosim.org"><!-- a comment -->
  <link name="a"><inertial><mass value="x"/></inertial><collision/></link><link name="b"/>
  <joint name="j" type="fixed"><axis xyz="0 0 0"/><parent link="a"/><child link="b"/>
    <origin rpy="0 0 1.5707963267948966"/><mimic joint="nobody"/></joint>
  <transmission name="t"><joint name="j"/></transmission><gazebo reference="a"/><gz:x/>
</robot>""")
    assert robot.joints[0].origin == pytest.approx(Pose.from_xyz_rpy(yaw=pi / 2))


def test_what_links_look_like_is_kept():
    robot = Robot.parse("""<robot name="r">
  <material name="red"><color rgba="1 0 0 0.5"/></material>
  <link name="a">
    <visual><origin xyz="0 0 1"/><geometry><box size="1 2 3"/></geometry>
      <material name="red"/></visual>
    <visual><geometry><cylinder radius="0.1" length="2"/></geometry>
      <material name=""><color rgba="0 0 1 1"/></material></visual>
    <visual><geometry><sphere radius="0.2"/></geometry><material name="unknown"/></visual>
    <visual><geometry><mesh filename="package://r/a.stl" scale="1 -1 1"/></geometry></visual>
    <visual><geometry><capsule radius="1" length="1"/></geometry></visual>
  </link></robot>""")
    assert robot.links['a'] == (
        Visual(Box((1.0, 2.0, 3.0)), Pose(z=1.0), (1.0, 0.0, 0.0, 0.5)),
        Visual(Cylinder(0.1, 2.0), Pose(), (0.0, 0.0, 1.0, 1.0)),
        Visual(Sphere(0.2), Pose(), None),
        Visual(Mesh('package://r/a.stl', (1.0, -1.0, 1.0)), Pose(), None))


def test_edges_compose_to_the_tip():
    edges = parsed(joint('j', 'revolute', 'a', 'b', axis='0 0 1'),
                   joint('k', 'revolute', 'b', 'c', xyz='1 0 0', axis='0 0 1'),
                   joint('tip', 'fixed', 'c', 'd', xyz='1 0 0')).edges([pi / 2, pi / 2])
    a_T_d = se3.compose_chain([*map(tuple, edges.values())])
    assert a_T_d == pytest.approx(Pose(x=-1.0, y=1.0, qz=1.0, qw=0.0), abs=1e-15)
