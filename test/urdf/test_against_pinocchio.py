# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Forward kinematics of whole robots, compared with another program's."""

import descriptions
from descriptions import at_random
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core.geometry import se3
from tf_tree_py.urdf import DescriptionError, Robot

pinocchio = pytest.importorskip(
    'pinocchio', reason='pinocchio is not installed: pip install pin')
if not hasattr(pinocchio, 'buildModelFromXML'):
    pytest.skip('this pinocchio is another package: pip install pin', allow_module_level=True)


def position_of(joint, given, by_name):
    """Return the position of a joint with one variable, including through mimic joints."""
    if joint.mimic is None:
        return given[joint.name]
    leader = position_of(by_name[joint.mimic.joint], given, by_name)
    return joint.mimic.multiplier * leader + joint.mimic.offset


def as_their_positions(robot, model, given):
    """Return a configuration in Pinocchio's format: unbounded angles as cosine and sine."""
    by_name = {joint.name: joint for joint in robot.joints}
    q = pinocchio.neutral(model)
    for joint in robot.moving:
        theirs = model.joints[model.getJointId(joint.name)]
        if joint.joint_type == 'floating':
            values = [given[name] for name in joint.variables]
            values[3:] = values[3:] / np.linalg.norm(values[3:])
        elif joint.joint_type == 'planar':
            x, y, theta = (given[name] for name in joint.variables)
            values = [x, y, np.cos(theta), np.sin(theta)]
        else:
            position = position_of(joint, given, by_name)
            values = [np.cos(position), np.sin(position)] if theirs.nq == 2 else [position]
        q[theirs.idx_q:theirs.idx_q + theirs.nq] = values
    return q


@pytest.mark.parametrize('seed', range(5))
def test_every_link_of_forty_joints_is_where_pinocchio_has_it(seed):
    text = at_random(seed)
    robot, model = Robot.parse(text), pinocchio.buildModelFromXML(text)
    data = model.createData()
    assert len(robot.joints) == 40 and {joint.joint_type for joint in robot.joints} == {
        'fixed', 'revolute', 'continuous', 'prismatic', 'planar', 'floating'}
    positions = np.random.default_rng(seed).uniform(-2.0, 2.0, (10, len(robot.variables)))
    edges = robot.edges(positions)
    for number, row in enumerate(positions):
        given = dict(zip(robot.variables, row, strict=True))
        pinocchio.framesForwardKinematics(model, data, as_their_positions(robot, model, given))
        buffer = BufferCore()
        for (parent, child), poses in edges.items():
            buffer.insert(parent, child, 1, poses[number])
        for link, pose in buffer.lookup_tree(robot.root, 1).items():
            theirs = data.oMf[model.getFrameId(link)].homogeneous
            # Forty edges with a metre or two each: coordinates reach tens of metres.
            assert np.abs(se3.as_matrix(pose) - theirs).max() < 1e-12


def test_chains_of_mimics_were_among_them():
    robots = [Robot.parse(at_random(seed)) for seed in range(5)]
    mimics = {joint.name for robot in robots for joint in robot.joints if joint.mimic}
    assert any(joint.mimic and joint.mimic.joint in mimics
               for robot in robots for joint in robot.joints)


# --- Pinocchio reads URDF with urdfdom, as robot_state_publisher does, but a later version of it.

ONE_JOINT = descriptions.robot(
    descriptions.joint('j', 'continuous', 'a', 'b', rpy='0 0 0.5', axis='0 0 1'))


@pytest.mark.parametrize('beside', ['', 'rpy="0 0 0.5" '])
def test_quaternion_of_an_origin_is_ignored_by_both(beside):
    text = ONE_JOINT.replace('rpy="0 0 0.5"', f'{beside}quat_xyzw="0 0 1 0"')
    theirs = pinocchio.buildModelFromXML(text).jointPlacements[1].homogeneous
    assert se3.as_matrix(Robot.parse(text).joints[0].origin) == pytest.approx(theirs)


@pytest.mark.parametrize('version', [
    '1.0', '01.00', ' 1. 0', '+1.0', '1.-0', '1.0.',
    '', '1', '1.', '.0', '1.0 ', '1.0.0', '1.0..', '0.9', '1.x', '2.0'])
def test_version_is_refused_by_both_or_by_neither(version):
    text = ONE_JOINT.replace('<robot ', f'<robot version="{version}" ')
    readers = {Robot.parse: DescriptionError, pinocchio.buildModelFromXML: ValueError}
    refused = []
    for read, error in readers.items():
        try:
            read(text)
        except error:
            refused.append(read)
    assert len(refused) in (0, len(readers))
