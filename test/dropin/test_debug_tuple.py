# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The reason of a missing transform, in tf2's words, and broadcasters' errors, by tf2's class."""

import json

from programs import completed
from standin import standin_env

PROGRAM = """
import json
import rclpy
rclpy.init()
from geometry_msgs.msg import Transform, TransformStamped
from rclpy.time import Time
import tf2_ros

def edge(parent, child, second):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp.sec = second
    return message

buffer = tf2_ros.Buffer()
for second in (1, 2, 3):
    buffer.set_transform(edge('map', 'odom', second), 'me')
    buffer.set_transform(edge('odom', 'base', second), 'me')
buffer.set_transform_static(edge('base', 'camera', 0), 'me')
buffer.set_transform_static(edge('island', 'tree', 0), 'me')
answers = []
for target, source, second in (('map', 'camera', 2), ('map', 'camera', 9), ('map', 'camera', 0.5),
                               ('map', 'camera', 0), ('map', 'nowhere', 0), ('nowhere', 'map', 2),
                               ('map', 'tree', 0), ('map', 'tree', 2)):
    time = Time(seconds=second)
    answers.append(buffer.can_transform(target, source, time, return_debug_tuple=True))
    answers.append(buffer.can_transform_core(target, source, time))
    answers.append(buffer.can_transform(target, source, time))
answers.append(buffer.can_transform_full(
    'map', Time(seconds=2), 'camera', Time(seconds=2), 'map', return_debug_tuple=True))
node = rclpy.create_node('sending')
for kind in (tf2_ros.TransformBroadcaster, tf2_ros.StaticTransformBroadcaster):
    for wrong in (Transform(), None, 5, 'abc', [Transform()], [5]):
        try:
            kind(node).sendTransform(wrong)
        except Exception as error:
            answers.append(type(error).__name__)
print(json.dumps(answers))
"""


def answers(tmp_path, *command):
    program = tmp_path / 'program.py'
    program.write_text(PROGRAM)
    done = completed('python3', *command, str(program), env=standin_env())
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_reasons_and_refusals_are_those_of_tf2(tmp_path):
    theirs = answers(tmp_path)
    assert [1, ''] in theirs and 'AttributeError' in theirs
    assert answers(tmp_path, '-m', 'tf_tree_py.dropin', '--force') == theirs
