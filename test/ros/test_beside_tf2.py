"""In one process with the real tf2: what is raised, taken and given goes together with its own."""

import subprocess
import textwrap

from standin import standin_env

TIMEOUT_S = 60


def run(code, **variables):
    """Run a program where tf2 is installed; return what it printed."""
    done = subprocess.run(
        ['python3', '-c', textwrap.dedent(code)], env={**standin_env(), **variables},
        capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


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
