# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""With the real tf2 in one process: our errors, arguments and results work with tf2's own."""

from standin import run_with_tf2 as run

# --- exceptions


def test_program_that_kept_the_import_of_the_exceptions_catches_ours():
    assert run("""
        from rclpy.time import Time
        from tf2_ros import (ConnectivityException, ExtrapolationException,
                             InvalidArgumentException, LookupException, TransformException)
        from geometry_msgs.msg import TransformStamped
        import tf_tree_py
        from tf_tree_py import Buffer

        buffer = Buffer()
        for parent, child in (('map', 'base'), ('other', 'tree')):
            message = TransformStamped(child_frame_id=child)
            message.header.frame_id = parent
            message.header.stamp.sec = 5
            buffer.set_transform(message, 'me')

        for source, seconds, theirs in (
                ('nowhere', 0, LookupException), ('tree', 0, ConnectivityException),
                ('base', 7, ExtrapolationException), ('base', 3, ExtrapolationException),
                ('/base', 0, InvalidArgumentException)):
            for catcher in (theirs, TransformException, tf_tree_py.TransformException,
                            getattr(tf_tree_py, theirs.__name__)):
                try:
                    buffer.lookup_transform('map', source, Time(seconds=seconds))
                except catcher as error:
                    print(type(error).__module__, type(error).__name__)
    """).split() == [word for name in (
        'LookupException', 'ConnectivityException', 'FutureExtrapolationException',
        'PastExtrapolationException', 'InvalidArgumentException')
        for _ in range(4) for word in ('tf_tree_py.core.errors', name)]


def test_real_tf2_may_be_imported_after_ours():
    assert run("""
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
            print(isinstance(again, tf2_py.LookupException), again.target_frame)
    """).split() == ['True', 'map']


def test_our_buffer_client_ends_in_an_exception_of_tf2():
    assert run("""
        import rclpy
        from rclpy.time import Time
        from tf2_ros import TimeoutException
        from tf_tree_py import BufferClient

        rclpy.init()
        with BufferClient(rclpy.create_node('asking'), 'nobody') as client:
            try:
                client.lookup_transform('map', 'base', Time())
            except TimeoutException as error:
                print('caught')
        rclpy.shutdown()
    """) == 'caught\n'


def test_types_that_nobody_registered_are_tf2s_type_exception():
    printed = run("""
        from std_msgs.msg import Header, String
        import tf2_ros
        from tf_tree_py import Buffer, BufferInterface
        import tf_tree_py

        for catcher in (tf2_ros.TypeException, tf_tree_py.TypeException):
            try:
                Buffer().transform(String(), 'map', header=Header())
            except catcher as error:
                print('String' in error.errstr, error.errstr == str(error))
        for catcher in (tf2_ros.NotImplementedException, tf_tree_py.NotImplementedException):
            try:
                BufferInterface().lookup_transform('map', 'base', None)
            except catcher as error:
                print(error)
    """).splitlines()
    assert printed == [*['True True'] * 2,
                       *['CanTransform or LookupTransform not implemented'] * 2]


# --- results


def test_messages_have_the_quaternions_of_tf2():
    assert run("""
        import random
        from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
        from rclpy.time import Time
        import tf2_geometry_msgs
        import tf2_ros
        from tf_tree_py import Buffer

        random.seed(1)

        def turn(q):
            q.x, q.y, q.z, q.w = (random.gauss(0, 1) for _ in range(4))
            size = (q.x**2 + q.y**2 + q.z**2 + q.w**2) ** 0.5
            q.x, q.y, q.z, q.w = q.x / size, q.y / size, q.z / size, q.w / size

        def same(a, b):
            return all(abs(getattr(a, name) - getattr(b, name)) < 1e-9 for name in 'xyzw')

        for _ in range(300):
            buffers = tf2_ros.Buffer(), Buffer()
            for parent, child in (('map', 'base'), ('base', 'arm')):
                message = TransformStamped(child_frame_id=child)
                message.header.frame_id = parent
                turn(message.transform.rotation)
                for buffer in buffers:
                    buffer.set_transform_static(message, 'me')
            for frames in (('map', 'arm'), ('arm', 'map'), ('arm', 'base'), ('map', 'map')):
                theirs, ours = (buffer.lookup_transform(*frames, Time())
                                for buffer in buffers)
                assert same(theirs.transform.rotation, ours.transform.rotation)
            pose = PoseStamped()
            pose.header.frame_id = 'arm'
            turn(pose.pose.orientation)
            theirs, ours = (buffer.transform(pose, 'map') for buffer in buffers)
            assert same(theirs.pose.orientation, ours.pose.orientation)
            there = PoseWithCovarianceStamped(header=pose.header)
            turn(there.pose.pose.orientation)
            theirs, ours = (buffer.transform(there, 'map') for buffer in buffers)
            assert same(theirs.pose.pose.orientation, ours.pose.pose.orientation)
        print('same')
    """) == 'same\n'


# --- objects


def test_buffer_of_tf2_given_to_our_listener_is_refused_in_a_sentence():
    printed = run("""
        import rclpy
        import tf2_ros
        from tf_tree_py import TransformListener

        rclpy.init()
        node = rclpy.create_node('mixed')
        try:
            TransformListener(tf2_ros.Buffer(), node)
        except TypeError as error:
            print(error)
        node.destroy_node()
        rclpy.shutdown()
    """)
    assert printed == ('TransformListener takes a Buffer of tf_tree_py, and this is a '
                       'tf2_ros.buffer.Buffer: create it with `from tf_tree_py import Buffer`\n')


def test_listener_of_tf2_fills_our_buffer():
    assert run("""
        import rclpy
        from rclpy.time import Time
        from geometry_msgs.msg import TransformStamped
        import tf2_ros
        from tf_tree_py import Buffer

        rclpy.init()
        node = rclpy.create_node('mixed')
        buffer = Buffer()
        listener = tf2_ros.TransformListener(buffer, node)
        fixed = tf2_ros.StaticTransformBroadcaster(node)
        message = TransformStamped(child_frame_id='base')
        message.header.frame_id = 'map'
        message.transform.translation.x = 2.0
        fixed.sendTransform(message)
        while not buffer.can_transform('map', 'base', Time()):
            rclpy.spin_once(node)
        print(buffer.lookup_transform('map', 'base', Time()).transform.translation.x)
        node.destroy_node()
        rclpy.shutdown()
    """) == '2.0\n'
