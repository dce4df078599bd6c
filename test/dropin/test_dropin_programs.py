# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which packages are found, and programs that run with them."""

import ast
import sys

from dropin_helpers import run
import pytest
from tf_tree_py import dropin

pytestmark = pytest.mark.usefixtures('installed')


# --- which is found

def test_installed_one_wins_unless_forced(program, real):
    file = program('import tf2_ros; print(tf2_ros.__file__)')
    left = run('-m', 'tf_tree_py.dropin', file, path=real)
    forced = run('-m', 'tf_tree_py.dropin', '--force', file, path=real)
    assert left.stdout.strip() == str(real / 'tf2_ros' / '__init__.py'), left.stderr
    assert forced.stdout.strip().startswith(dropin.PACKAGES), forced.stderr
    assert f'installed as {real}' in left.stderr and '--force' in left.stderr
    assert forced.stderr == ''


def test_forcing_after_the_import_is_refused(real):
    result = run('-c', 'import tf2_ros, tf_tree_py.dropin\n'
                       'tf_tree_py.dropin.install()\n'
                       'try: tf_tree_py.dropin.install(force=True)\n'
                       'except RuntimeError as error: print(error)', path=real)
    assert 'tf2_ros was imported from ' in result.stdout, result.stderr
    assert 'install(force=True) before the first import' in result.stdout


def test_installing_twice_is_once():
    dropin.install(force=True)
    dropin.install(force=True)
    assert sys.path.count(dropin.PACKAGES) == 1


def test_messages_are_made_known_to_an_installed_tf2_ros(program, real):
    file = program("""
        import tf2_geometry_msgs, tf2_ros, tf2_sensor_msgs
        print(sorted(kind.__name__ for kind in tf2_ros.TransformRegistration().known))
    """)
    known = ast.literal_eval(run('-m', 'tf_tree_py.dropin', file, path=real).stdout)
    assert {'PointStamped', 'PoseStamped', 'Vector3Stamped', 'PointCloud2'} <= set(known)
    assert 'Odometry' not in known, 'neither package has this message'


# --- running programs

def test_program_runs_as_by_python_itself(program, tmp_path):
    program('VALUE = 7', 'beside.py')
    file = program("""
        import sys
        import beside, tf2_ros
        if __name__ == '__main__':
            print(sys.argv[1:], beside.VALUE, sys.path[0], __file__, issubclass(
                tf2_ros.LookupException, tf2_ros.TransformException))
            sys.exit(3)
    """)
    result = run('-m', 'tf_tree_py.dropin', file, '--ros-args', '-p', 'a:=1', '--force')
    assert result.returncode == 3, result.stderr
    assert result.stdout.split() == [
        "['--ros-args',", "'-p',", "'a:=1',", "'--force']", '7', str(tmp_path), str(file), 'True']


def test_safe_path_stays_safe(program, tmp_path):
    file = program('import sys; print(sys.path)')
    if not hasattr(sys.flags, 'safe_path'):
        pytest.skip('python -P came with 3.11')
    result = run('-P', '-m', 'tf_tree_py.dropin', file)
    assert str(tmp_path) not in ast.literal_eval(result.stdout), result.stderr


def test_module_runs_as_by_python_itself(program, tmp_path):
    program("""
        def test_of_somebody():
            from tf2_ros import Buffer
            assert Buffer().all_frames_as_string() == ''
    """, 'test_theirs.py')
    result = run('-m', 'tf_tree_py.dropin', '-m', 'pytest', '-q', 'test_theirs.py', cwd=tmp_path)
    assert '1 passed' in result.stdout, result.stdout + result.stderr


@pytest.mark.parametrize(('arguments', 'sentence'), [
    ([], 'the following arguments are required: program'),
    (['nowhere.py'], "there is no 'nowhere.py' to run"),
])
def test_mistake_is_one_sentence(arguments, sentence):
    result = run('-m', 'tf_tree_py.dropin', *arguments)
    assert result.returncode == 2
    assert sentence in result.stderr
    assert 'Traceback' not in result.stderr


def test_path_is_told_for_other_ways_to_start_programs(program):
    told = run('-m', 'tf_tree_py.dropin', '--path').stdout.strip()
    assert told == dropin.PACKAGES
    result = run(program('import tf2_ros; print(tf2_ros.__file__)'), path=told)
    assert result.stdout.startswith(told), result.stderr


UNCHANGED = """
    import sys
    import rclpy
    from rclpy.node import Node
    from geometry_msgs.msg import PointStamped, TransformStamped
    import tf2_geometry_msgs  # noqa: F401
    from tf2_ros import TransformException
    from tf2_ros.buffer import Buffer
    from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster
    from tf2_ros.transform_broadcaster import TransformBroadcaster
    from tf2_ros.transform_listener import TransformListener


    class Robot(Node):

        def __init__(self):
            super().__init__('robot')
            self.buffer = Buffer()
            self.listener = TransformListener(self.buffer, self)
            self.fixed = StaticTransformBroadcaster(self)
            self.moving = TransformBroadcaster(self)
            self.fixed.sendTransform(self.transform('base_link', 'camera', 0.2))
            self.create_timer(0.05, self.work)

        def transform(self, parent, child, x):
            message = TransformStamped()
            message.header.stamp = self.get_clock().now().to_msg()
            message.header.frame_id = parent
            message.child_frame_id = child
            message.transform.translation.x = x
            message.transform.rotation.w = 1.0
            return message

        def work(self):
            self.moving.sendTransform(self.transform('map', 'base_link', 1.0))
            point = PointStamped()
            point.header.frame_id = 'camera'
            point.point.x = 1.0
            try:
                found = self.buffer.transform(point, 'map')
            except TransformException as error:
                self.get_logger().info(f'Could not transform: {error}')
                return
            print('found', round(found.point.x, 6))
            raise SystemExit


    rclpy.init()
    node = Robot()
    try:
        rclpy.spin(node)
    except SystemExit:
        rclpy.shutdown()
"""


def test_node_of_tf2_runs_unchanged(program):
    result = run('-m', 'tf_tree_py.dropin', '--force', program(UNCHANGED))
    assert 'found 2.2' in result.stdout, result.stderr
    assert result.returncode == 0
    assert 'Traceback' not in result.stderr
