# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The program with tf2's arguments, and the messages that it publishes."""

import math
from pathlib import Path

from conditions import until
import numpy as np
from programs import PATIENCE_S
import pytest
from rclpy.node import Node
from tf_tree_py import CovarianceListener
from tf_tree_py.core import LATEST, Pose
from tf_tree_py.nodes import static_transform_publisher
from tf_tree_py.nodes.running import spun_in_background
from tf_tree_py.nodes.static_transform_publisher import main, StaticTransformPublisher
from tf_tree_py.nodes.static_transforms import from_yaml

EXAMPLE = Path(__file__).parents[2] / 'config' / 'static_transforms.yaml'
FRAMES = ['--frame-id', 'a', '--child-frame-id', 'b']


@pytest.fixture
def published(monkeypatch):
    """Return a function with a command line's transforms, and whether its form is the old one."""
    def published(*arguments):
        jobs = []
        monkeypatch.setattr(static_transform_publisher, 'work',
                            lambda _, transforms, old_form: jobs.append((transforms, old_form)))
        monkeypatch.setattr(static_transform_publisher, 'run', lambda name, argv, work: work(None))
        main(['static_transform_publisher', *arguments])
        return jobs[0]

    return published


@pytest.mark.parametrize(('arguments', 'pose'), [
    ([], Pose()),
    (['--x', '1', '--y', '-2.5', '--z', '-1e-3'], Pose(1.0, -2.5, -1e-3)),
    (['--x=-.5', '--qz', '1', '--qw', '0'], Pose(x=-0.5, qz=1.0, qw=0.0)),
    (['--yaw', '-3.141592653589793'], Pose(qz=-1.0, qw=0.0)),
])
def test_arguments_are_those_of_tf2(published, arguments, pose):
    transforms, old_form = published(*arguments, *FRAMES)
    assert [(t.parent, t.child) for t in transforms] == [('a', 'b')]
    assert transforms[0].pose == pytest.approx(pose, abs=1e-15)
    assert not old_form


def test_ros_arguments_may_stand_among_them(published):
    transforms, _ = published('--x', '1', '--ros-args', '-r', '__node:=n', '--', *FRAMES)
    assert transforms[0].pose == Pose(x=1.0)


@pytest.mark.parametrize(('arguments', 'pose'), [
    # Yaw comes first.
    (['1', '-2', '3e-1', '0.3', '-0.2', '0.1'], Pose.from_xyz_rpy(1, -2, 0.3, 0.1, -0.2, 0.3)),
    (['1', '2', '3', '0', '0', '-1', '0'], Pose(1.0, 2.0, 3.0, qz=-1.0, qw=0.0)),
])
def test_old_forms_still_work(published, arguments, pose):
    transforms, old_form = published(*arguments, '/map', 'odom')
    assert transforms == [('map', 'odom', pytest.approx(pose), None)]
    assert old_form


@pytest.mark.parametrize(('arguments', 'sentence'), [
    ([], 'the frame id is missing'),
    (['--frame-id', 'a'], 'the child frame id is missing'),
    (['--frame-id', 'a', '--child-frame-id', 'a'], "both 'a'"),
    ([*FRAMES, '--x', 'abc'], "argument --x: 'abc' is not a finite number"),
    ([*FRAMES, '--x', 'inf'], "argument --x: 'inf' is not a finite number"),
    ([*FRAMES, '--x'], 'argument --x: expected one argument'),
    ([*FRAMES, '--speed', '3'], 'unrecognized arguments: --speed=3'),
    ([*FRAMES, '--qx', '1', '--yaw', '1'], 'as qx qy qz qw or as roll pitch yaw'),
    ([*FRAMES, '--qw', '0'], 'the quaternion is all zero'),
    ([*FRAMES, '1', '2'], 'cannot specify both'),
    (['1', '2', '3', '0', '0', '0', 'a', 'b', '--x', '1'], 'cannot specify both'),
    (['1', '2', '3', '0', '0', 'z', 'a', 'b'], "roll is 'z', which is not a finite number"),
    (['1', '2', '3'], 'belong to no flag: 1 2 3'),
    (['--yaml', '/nowhere.yaml'], '/nowhere.yaml cannot be read'),
    (['--yaml', 'x.yaml', *FRAMES], '--yaml cannot be combined'),
])
def test_mistake_is_one_sentence(monkeypatch, capsys, arguments, sentence):
    monkeypatch.setattr(static_transform_publisher, 'run', None)
    with pytest.raises(SystemExit) as ended:
        main(['static_transform_publisher', *arguments])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told.startswith('static_transform_publisher: ')
    assert sentence in told
    assert told.count('\n') == 1


def test_all_of_a_file_arrives_also_late(context, buffer):
    transforms = from_yaml(str(EXAMPLE))
    with spun_in_background(StaticTransformPublisher(transforms, context=context)):
        for parent, child, pose, _ in transforms:
            assert buffer.lookup_within(PATIENCE_S, parent, child) == pytest.approx(pose)
    assert all(edge.static for edge in buffer.edges())


def test_covariances_of_a_file_arrive_also_late(context, buffer):
    transforms = from_yaml(str(EXAMPLE))
    known = [one for one in transforms if one.covariance is not None]
    assert known
    node = Node('asking', context=context)
    with (spun_in_background(StaticTransformPublisher(transforms, context=context)),
            CovarianceListener(buffer, node)):
        for parent, child, _, covariance in known:
            buffer.lookup_within(PATIENCE_S, parent, child)
            until(lambda parent=parent, child=child: any(
                buffer.lookup_uncertain(parent, child).pose.covariance))
            found = np.array(buffer.lookup_uncertain(parent, child).pose.covariance)
            assert found == pytest.approx(covariance.ravel())
    node.destroy_node()


def test_process_publishes_until_ctrl_c(start, buffer):
    program = start('static_transform_publisher', '1', '0', '-2', '1.5707963267948966', '0', '0',
                    'map', 'odom')
    pose = buffer.lookup_within(PATIENCE_S, 'map', 'odom', LATEST)
    assert pose == pytest.approx(Pose(1.0, 0.0, -2.0, qz=math.sqrt(0.5), qw=math.sqrt(0.5)))
    program.wait_for('Old-style arguments are deprecated')
    program.wait_for('map -> odom: (1.000, 0.000, -2.000) m, rpy (0.00, 0.00, 90.00) deg')
    program.interrupt()
    assert program.end() == 0
    assert 'Traceback' not in program.output
