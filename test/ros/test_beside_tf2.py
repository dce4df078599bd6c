# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""With the real tf2 in one process: our errors, arguments and results work with tf2's own."""

from standin import run_with_tf2 as run

CAUGHT = """
def caught(ask, *kinds):
    '''Return the error that a function raises; each of the kinds must catch it.'''
    for kind in kinds:
        try:
            ask()
        except kind as error:
            last = error
        else:
            raise AssertionError('it raised nothing')
    return last
"""


def test_real_tf2_may_be_imported_after_ours():
    run("""
        from tf_tree_py import BufferCore
        buffer = BufferCore()
        import sys
        assert 'tf2_py' not in sys.modules
        import tf2_py
        import pickle
        try:
            buffer.lookup('map', 'base')
        except tf2_py.LookupException as error:
            again = pickle.loads(pickle.dumps(error))
            assert isinstance(again, tf2_py.LookupException) and again.target_frame == 'map'
        else:
            raise AssertionError('it raised nothing')
    """)


def test_program_that_catches_errors_of_tf2_catches_ours():
    run(CAUGHT + """
from geometry_msgs.msg import TransformStamped
from rclpy.time import Time
from std_msgs.msg import Header, String
import tf2_ros
import tf_tree_py

buffer = tf_tree_py.Buffer()
for parent, child in (('map', 'base'), ('other', 'tree')):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp.sec = 5
    buffer.set_transform(message, 'me')

for source, seconds, name, ours in (
        ('nowhere', 0, 'LookupException', 'LookupException'),
        ('tree', 0, 'ConnectivityException', 'ConnectivityException'),
        ('base', 7, 'ExtrapolationException', 'FutureExtrapolationException'),
        ('base', 3, 'ExtrapolationException', 'PastExtrapolationException'),
        ('/base', 0, 'InvalidArgumentException', 'InvalidArgumentException')):
    error = caught(lambda: buffer.lookup_transform('map', source, Time(seconds=seconds)),
                   getattr(tf2_ros, name), tf2_ros.TransformException,
                   getattr(tf_tree_py, name), tf_tree_py.TransformException)
    assert (type(error).__module__, type(error).__name__) == ('tf_tree_py.core.errors', ours)

error = caught(lambda: buffer.transform(String(), 'map', header=Header()),
               tf2_ros.TypeException, tf_tree_py.TypeException)
assert 'String' in error.errstr and error.errstr == str(error)
error = caught(lambda: tf_tree_py.BufferInterface().lookup_transform('map', 'base', None),
               tf2_ros.NotImplementedException, tf_tree_py.NotImplementedException)
assert str(error) == 'CanTransform or LookupTransform not implemented'
""")


def test_messages_have_the_quaternions_of_tf2():
    run("""
        import random
        from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
        from rclpy.time import Time
        import tf2_geometry_msgs
        import tf2_ros
        from tf_tree_py import Buffer

        random.seed(1)

        def turn(q):
            values = [random.gauss(0, 1) for _ in range(4)]
            size = sum(value**2 for value in values) ** 0.5
            q.x, q.y, q.z, q.w = (value / size for value in values)

        def assert_same(a, b):
            assert all(abs(getattr(a, name) - getattr(b, name)) < 1e-9 for name in 'xyzw')

        for _ in range(300):
            buffers = tf2_ros.Buffer(), Buffer()
            for parent, child in (('map', 'base'), ('base', 'arm')):
                message = TransformStamped(child_frame_id=child)
                message.header.frame_id = parent
                turn(message.transform.rotation)
                for buffer in buffers:
                    buffer.set_transform_static(message, 'me')
            for frames in (('map', 'arm'), ('arm', 'map'), ('arm', 'base'), ('map', 'map')):
                assert_same(*(buffer.lookup_transform(*frames, Time()).transform.rotation
                              for buffer in buffers))
            pose = PoseStamped()
            pose.header.frame_id = 'arm'
            turn(pose.pose.orientation)
            assert_same(*(buffer.transform(pose, 'map').pose.orientation for buffer in buffers))
            there = PoseWithCovarianceStamped(header=pose.header)
            turn(there.pose.pose.orientation)
            assert_same(*(buffer.transform(there, 'map').pose.pose.orientation
                          for buffer in buffers))
    """)


def test_objects_of_tf2_meet_ours_in_one_node():
    run(CAUGHT + """
from geometry_msgs.msg import TransformStamped
import rclpy
from rclpy.time import Time
import tf2_ros
from tf_tree_py import Buffer, BufferClient, TransformListener

rclpy.init()
node = rclpy.create_node('mixed')

# Our listener refuses tf2's buffer.
assert str(caught(lambda: TransformListener(tf2_ros.Buffer(), node), TypeError)) == (
    'TransformListener takes a Buffer of tf_tree_py, and this is a tf2_ros.buffer.Buffer: '
    'create it with `from tf_tree_py import Buffer`')

# Our client raises tf2's exception.
with BufferClient(node, 'nobody') as client:
    caught(lambda: client.lookup_transform('map', 'base', Time()), tf2_ros.TimeoutException)

# The listener of tf2 fills our buffer.
buffer = Buffer()
listener = tf2_ros.TransformListener(buffer, node)
fixed = tf2_ros.StaticTransformBroadcaster(node)
message = TransformStamped(child_frame_id='base')
message.header.frame_id = 'map'
message.transform.translation.x = 2.0
fixed.sendTransform(message)
while not buffer.can_transform('map', 'base', Time()):
    rclpy.spin_once(node)
assert buffer.lookup_transform('map', 'base', Time()).transform.translation.x == 2.0

node.destroy_node()
rclpy.shutdown()
""")
