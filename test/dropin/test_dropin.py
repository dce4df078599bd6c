"""Code that was written for tf2_ros, run as it is."""

import ast
import importlib
import inspect
import os
import subprocess
import sys
import textwrap
import threading
import time

from geometry_msgs.msg import (
    Point,
    PointStamped,
    PolygonStamped,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3Stamped,
)
import numpy as np
import pytest
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time
from ros_helpers import at, lasting, PATIENCE, PATIENCE_S, transform, until
from std_msgs.msg import Header
from tf2_msgs.action import LookupTransform
from tf2_msgs.msg import TFMessage
import tf_tree_py
from tf_tree_py import dropin
from tf_tree_py.dropin import listener as listener_module, spinning
from tf_tree_py.ros.messages.point_cloud import packed_cloud


@pytest.fixture(autouse=True, scope='module')
def installed():
    """Ours, also where tf2's own are installed; and as before afterwards."""
    path = sys.path[:]
    others = {name: sys.modules.pop(name) for name in list(sys.modules) if is_tf2(name)}
    dropin.install(force=True)
    yield
    for name in filter(is_tf2, list(sys.modules)):
        del sys.modules[name]
    sys.modules.update(others)
    sys.path[:] = path


def is_tf2(name):
    return name.split('.')[0] in dropin.NAMES


def run(*arguments, path='', **options):
    """Run Python; the packages on its path are found as if they were installed."""
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(path), os.environ.get('PYTHONPATH', '')])}
    return subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, text=True,
                          env=environment, timeout=PATIENCE_S, check=False, **options)


@pytest.fixture
def program(tmp_path):
    """Write a program, and return its path."""
    def write(code, name='program.py'):
        file = tmp_path / name
        file.write_text(textwrap.dedent(code))
        return file

    return write


@pytest.fixture
def real(tmp_path):
    """Return a folder with a tf2_ros that somebody installed, and not we."""
    folder = tmp_path / 'installed'
    (folder / 'tf2_ros').mkdir(parents=True)
    (folder / 'tf2_ros' / '__init__.py').write_text(textwrap.dedent("""
        class Registration:
            known = {}
            def add(self, key, callback):
                self.known[key] = callback
            add_to_msg = add_from_msg = lambda self, key, callback: None
        TransformRegistration = ConvertRegistration = Registration
    """))
    return folder


# --- names

SIGNATURES = {
    'tf2_py': {
        'BufferCore': 'cache_time',
        'BufferCore.set_transform': 'transform authority',
        'BufferCore.set_transform_static': 'transform authority',
        'BufferCore.can_transform_core': 'target_frame source_frame time',
        'BufferCore.can_transform_full_core':
            'target_frame target_time source_frame source_time fixed_frame',
        'BufferCore.lookup_transform_core': 'target_frame source_frame time',
        'BufferCore.lookup_transform_full_core':
            'target_frame target_time source_frame source_time fixed_frame',
        'BufferCore.get_latest_common_time': 'target_frame source_frame',
        'BufferCore.all_frames_as_yaml': '',
        'BufferCore.all_frames_as_string': '',
        'BufferCore.clear': '',
        'BufferCore.lookupVelocityCore':
            'tracking_frame observation_frame time averaging_interval',
        'BufferCore.lookupVelocityFullCore':
            'tracking_frame observation_frame reference_frame reference_point '
            'reference_point_frame time averaging_interval',
        'BufferCore._chain': 'target_frame target_time source_frame source_time fixed_frame',
        'BufferCore._frameExists': 'frame_id',
        'BufferCore._getFrameStrings': '',
        'BufferCore._allFramesAsDot': '',
    },
    'tf2_ros': {
        'Buffer': 'cache_time node',
        'Buffer.lookup_transform': 'target_frame source_frame time timeout',
        'Buffer.lookup_transform_full':
            'target_frame target_time source_frame source_time fixed_frame timeout',
        'Buffer.can_transform': 'target_frame source_frame time timeout return_debug_tuple',
        'Buffer.can_transform_full':
            'target_frame target_time source_frame source_time fixed_frame timeout '
            'return_debug_tuple',
        'Buffer.time_jump_callback': 'time_jump',
        'Buffer.lookup_transform_async': 'target_frame source_frame time',
        'Buffer.lookup_transform_full_async':
            'target_frame target_time source_frame source_time fixed_frame',
        'Buffer.wait_for_transform_async': 'target_frame source_frame time',
        'Buffer.wait_for_transform_full_async':
            'target_frame target_time source_frame source_time fixed_frame',
        'BufferInterface.transform': 'object_stamped target_frame timeout new_type',
        'BufferInterface.transform_full':
            'object_stamped target_frame target_time fixed_frame timeout new_type',
        'Stamped': 'obj stamp frame_id',
        'convert': 'a b_type',
        'TransformRegistration.add': 'key callback',
        'TransformRegistration.get': 'key',
        'TransformRegistration.print_me': '',
        'ConvertRegistration.add_from_msg': 'key callback',
        'ConvertRegistration.add_to_msg': 'key callback',
        'ConvertRegistration.add_convert': 'key callback',
        'ConvertRegistration.get_from_msg': 'key',
        'ConvertRegistration.get_to_msg': 'key',
        'ConvertRegistration.get_convert': 'key',
        'TypeException': 'errstr',
        'NotImplementedException': '',
        'TransformListener':
            'buffer node spin_thread qos static_qos tf_topic tf_static_topic static_only',
        'TransformListener.unregister': '',
        'StaticTransformListener': 'buffer node spin_thread static_qos tf_static_topic',
        'TransformBroadcaster': 'node qos',
        'TransformBroadcaster.sendTransform': 'transform',
        'StaticTransformBroadcaster': 'node qos',
        'StaticTransformBroadcaster.sendTransform': 'transform',
        'BufferClient': 'node ns check_frequency timeout_padding',
        'BufferClient.lookup_transform': 'target_frame source_frame time timeout',
        'BufferClient.can_transform': 'target_frame source_frame time timeout',
        'BufferClient.destroy': '',
    },
    'tf2_geometry_msgs': {
        'do_transform_point': 'point transform',
        'do_transform_vector3': 'vector3 transform',
        'do_transform_pose': 'pose transform',
        'do_transform_pose_stamped': 'pose transform',
        'do_transform_pose_with_covariance_stamped': 'pose transform',
        'do_transform_polygon_stamped': 'polygon transform',
        'transform_covariance': 'cov_in transform',
        'to_msg_msg': 'msg',
        'from_msg_msg': 'msg',
    },
    'tf2_sensor_msgs': {
        'do_transform_cloud': 'cloud transform',
        'transform_points': 'point_cloud transform',
        'to_msg_msg': 'msg',
        'from_msg_msg': 'msg',
    },
}


@pytest.mark.parametrize(('module', 'name', 'parameters'), [
    (module, name, parameters) for module, table in SIGNATURES.items()
    for name, parameters in table.items()])
def test_name_and_arguments_are_those_of_tf2(module, name, parameters):
    found = importlib.import_module(module)
    for part in name.split('.'):
        found = getattr(found, part)
    ours = [parameter for parameter in inspect.signature(found).parameters
            if parameter != 'self']
    assert ours[:len(parameters.split())] == parameters.split()
    # What we add is never required.
    for parameter in list(inspect.signature(found).parameters.values())[len(parameters.split()):]:
        assert (parameter.name == 'self' or parameter.default is not parameter.empty
                or parameter.kind is parameter.VAR_KEYWORD or parameter.name in parameters)


@pytest.mark.parametrize('home', [
    'buffer.Buffer', 'buffer_client.BufferClient', 'buffer_interface.BufferInterface',
    'transform_listener.TransformListener', 'transform_broadcaster.TransformBroadcaster',
    'static_transform_broadcaster.StaticTransformBroadcaster',
    'static_transform_listener.StaticTransformListener'])
def test_submodules_have_the_same_classes(home):
    import tf2_ros
    module, name = home.split('.')
    assert getattr(importlib.import_module(f'tf2_ros.{module}'), name) is getattr(tf2_ros, name)
    # As tf2_ros does, for those who write tf2_ros.buffer.Buffer.
    assert getattr(getattr(tf2_ros, module), name) is getattr(tf2_ros, name)


def test_everything_can_be_imported_with_a_star():
    for module in dropin.NAMES:
        names = {}
        exec(f'from {module} import *', names)
        assert set(importlib.import_module(module).__all__) <= set(names)


def test_unknown_name_is_an_attribute_error():
    import tf2_ros
    with pytest.raises(AttributeError, match="has no attribute 'Bufer'"):
        _ = tf2_ros.Bufer
    assert 'Buffer' in dir(tf2_ros)


def test_names_that_come_along_are_there():
    """Those that tf2's files import: programs take them from there."""
    from tf2_geometry_msgs import PointStamped, PoseStamped
    from tf2_geometry_msgs.tf2_geometry_msgs import TransformStamped
    import tf2_ros
    from tf2_ros.buffer_interface import Duration, Time
    assert tf2_ros.TransformStamped is TransformStamped
    assert (tf2_ros.Duration, tf2_ros.Time) == (Duration, Time)
    assert Duration(seconds=1).nanoseconds == 10**9
    assert {kind.__module__.split('.')[0] for kind in (PointStamped, PoseStamped)} == {
        'geometry_msgs'}


def test_exceptions_are_one_family_everywhere():
    import tf2_py
    import tf2_ros
    for name in ('Connectivity', 'Lookup', 'Extrapolation', 'InvalidArgument', 'Timeout'):
        kind = getattr(tf2_ros, f'{name}Exception')
        assert kind is getattr(tf2_py, f'{name}Exception')
        assert kind is getattr(tf_tree_py, f'{name}Exception')
        assert kind.__mro__[1] is tf2_py.TransformException
    assert issubclass(tf2_py.TransformException, Exception)


def test_import_alone_loads_no_messages():
    result = run('-m', 'tf_tree_py.dropin', '-m', 'this')
    assert 'Beautiful is better' in result.stdout, result.stderr
    loaded = 'print([name for name in sys.modules if "rclpy" in name or "msg" in name])'
    # An installed tf2_ros, if there is one, loads them itself.
    for rest in ('install()', 'install(force=True)\nimport tf2_ros'):
        result = run('-c', f'import sys, tf_tree_py.dropin\ntf_tree_py.dropin.{rest}\n{loaded}')
        assert result.stdout == '[]\n', result.stderr


# --- which is found

def test_installed_one_wins_unless_forced(program, real):
    file = program('import tf2_ros; print(tf2_ros.__file__)')
    left = run('-m', 'tf_tree_py.dropin', file, path=real)
    forced = run('-m', 'tf_tree_py.dropin', '--force', file, path=real)
    assert left.stdout.strip() == str(real / 'tf2_ros' / '__init__.py'), left.stderr
    assert forced.stdout.strip().startswith(dropin.PACKAGES), forced.stderr


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
    assert 'Odometry' not in known, 'that is a message of neither package'


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


# --- behaviour

def test_setting_returns_nothing_as_in_tf2():
    import tf2_py
    import tf2_ros
    for kind in (tf2_py.BufferCore, tf2_ros.Buffer):
        buffer = kind()
        assert buffer.set_transform(transform('map', 'base', 1.0), 'somebody') is None
        assert buffer.set_transform_static(transform('base', 'camera'), 'somebody') is None
        assert buffer.can_transform_core('map', 'camera', at(1.0)) == (True, '')
    assert isinstance(buffer, tf2_py.BufferCore)
    assert isinstance(buffer, tf2_ros.BufferInterface)
    assert isinstance(buffer, tf_tree_py.Buffer)


def test_cache_time_is_the_first_argument():
    import tf2_py
    import tf2_ros
    for buffer in (tf2_ros.Buffer(Duration(seconds=2)), tf2_py.BufferCore(Duration(seconds=2))):
        for seconds in (1.0, 5.0, 6.0):
            buffer.set_transform(transform('map', 'base', seconds), 'somebody')
        assert not buffer.can_transform_core('map', 'base', at(1.0))[0]


def test_time_of_rclpy_may_be_the_stamp_of_a_message():
    """It has no business there, but tf2's bindings and tests let it in."""
    import tf2_ros
    buffer = tf2_ros.Buffer()
    for second in range(5):
        message = transform('map', 'base', w=1.0)
        message.header.stamp = Time(seconds=second)
        message.transform.translation.x = 3 * second
        buffer.set_transform(message, 'somebody')
    found = buffer.lookup_transform('map', 'base', Time(seconds=1, nanoseconds=500_000_000))
    assert found.transform.translation.x == 4.5
    (x, y, z), _ = buffer.lookupVelocityCore('base', 'map', Time(), Duration(seconds=4))
    assert (x, y, z) == pytest.approx((3.0, 0.0, 0.0))


def test_coroutine_can_be_driven_by_hand():
    import tf2_ros
    buffer = tf2_ros.Buffer()
    waiting = buffer.lookup_transform_async('map', 'base', at(1.0))
    assert waiting.send(None) is None
    buffer.set_transform(transform('map', 'base', 1.0, x=2.0), 'somebody')
    with pytest.raises(StopIteration) as ended:
        waiting.send(None)
    assert ended.value.value.transform.translation.x == 2.0


def test_messages_are_transformed():
    import tf2_geometry_msgs
    import tf2_ros
    buffer = tf2_ros.Buffer()
    upside_down = transform('a', 'b', 2.0, x=1.0)
    upside_down.transform.rotation = Quaternion(x=1.0, w=0.0)
    buffer.set_transform(upside_down, 'somebody')
    point = PointStamped(point=Point(x=1.0, y=2.0, z=3.0))
    point.header.frame_id = 'a'
    point.header.stamp = at(2.0).to_msg()
    found = buffer.transform(point, 'b', new_type=PointStamped).point
    assert (found.x, found.y, found.z) == pytest.approx((0.0, -2.0, -3.0))
    a_T_b = buffer.lookup_transform('a', 'b', at(2.0))
    for name, kind in (('point', PointStamped), ('vector3', Vector3Stamped), ('pose', Pose),
                       ('pose_stamped', PoseStamped), ('polygon_stamped', PolygonStamped),
                       ('pose_with_covariance_stamped', PoseWithCovarianceStamped)):
        assert type(getattr(tf2_geometry_msgs, f'do_transform_{name}')(kind(), a_T_b)) is kind
    from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_point
    assert do_transform_point is tf2_geometry_msgs.do_transform_point


def test_clouds_are_transformed():
    import tf2_sensor_msgs
    a_T_b = transform('a', 'b', x=1.0)
    moved = tf2_sensor_msgs.transform_points([[1.0, 2.0, 3.0]], a_T_b.transform)
    assert moved.tolist() == [[2.0, 2.0, 3.0]]
    cloud = tf2_sensor_msgs.do_transform_cloud(packed_cloud(
        Header(frame_id='b'), {name: np.array([3.0]) for name in 'xyz'}, is_dense=True), a_T_b)
    assert cloud.header.frame_id == 'a'
    assert tf_tree_py.as_points(cloud).tolist() == [[4.0, 3.0, 3.0]]


def test_own_type_is_registered_as_in_tf2():
    import tf2_ros

    class Thing:
        """Somebody's own."""

    tf2_ros.TransformRegistration().add(Thing, lambda thing, transform: transform)
    buffer = tf2_ros.Buffer()
    buffer.set_transform(transform('a', 'b', 1.0), 'somebody')
    thing = tf2_ros.Stamped(Thing(), at(1.0).to_msg(), 'b')
    assert isinstance(buffer.transform(thing, 'a'), TransformStamped)


class OwnInterface:
    """Mixed into tf2's interface by those who have a buffer of their own."""

    def __init__(self):
        super().__init__()
        self.registration = 'theirs'


def test_registration_may_be_replaced():
    import tf2_ros
    kind = type('Own', (OwnInterface, tf2_ros.BufferInterface), {})
    assert kind().registration == 'theirs'
    with pytest.raises(tf2_ros.NotImplementedException):
        kind().lookup_transform('a', 'b', Time())


# --- spinning

@pytest.fixture
def spinner(context, node):
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    yield executor
    executor.shutdown()


def spin_until(executor, condition):
    """Spin as programs do, each time until something happens on the node."""
    while not condition():
        begin = time.monotonic()
        executor.spin_once(timeout_sec=PATIENCE_S)
        assert time.monotonic() - begin < PATIENCE_S, 'nothing woke it'


@pytest.fixture
def begin():
    """Make listeners of tf2_ros that end with the test."""
    listeners = []

    def make(*arguments, **options):
        import tf2_ros
        listeners.append(tf2_ros.TransformListener(*arguments, **options))
        return listeners[-1]

    yield make
    for listener in listeners:
        listener.unregister()


def test_loop_of_spin_once_ends_when_the_transform_has_come(node, talker, spinner, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    talker.move(transform('map', 'odom', 1.0))
    talker.move(transform('odom', 'base', 1.0))
    spin_until(spinner, lambda: buffer.can_transform('map', 'base', Time()))
    assert buffer.lookup_transform('map', 'base', Time()).child_frame_id == 'base'


def test_callback_may_wait(node, talker, spinner, begin):
    """What tf2 cannot do: see its pains."""
    import tf2_ros
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    found = []

    def look():
        timer.cancel()
        found.append(buffer.lookup_transform('map', 'base', Time(), PATIENCE))

    timer = node.create_timer(0.0, look)
    talker.fix(transform('map', 'base'))
    spin_until(spinner, lambda: found)
    assert found[0].header.frame_id == 'map'


def test_events_executor_spins_the_node_and_is_woken(node, talker, context, begin):
    import tf2_ros
    experimental = pytest.importorskip('rclpy.experimental')
    buffer = tf2_ros.Buffer()
    begin(buffer, node)
    executor = experimental.EventsExecutor(context=context)
    executor.add_node(node)
    talker.move(transform('map', 'odom', 1.0))
    spin_until(executor, lambda: buffer.can_transform('map', 'odom', Time()))
    executor.shutdown()


WAITS_BY_SPIN_ONCE = """
    import rclpy
    from rclpy.time import Time
    import tf2_ros

    rclpy.init()
    node = rclpy.create_node('waits')
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer, node)
    broadcaster = tf2_ros.StaticTransformBroadcaster(node)
    message = tf2_ros.TransformStamped(child_frame_id='camera')
    message.header.frame_id = 'base'
    broadcaster.sendTransform(message)
    # It came before the node is spun for the first time.
    assert buffer.can_transform('base', 'camera', Time(), rclpy.duration.Duration(seconds=20))
    rclpy.spin_once(node)
    print('returned')
    rclpy.shutdown()
"""


def test_first_spin_once_returns_for_what_came_before(program):
    result = run('-m', 'tf_tree_py.dropin', '--force', program(WAITS_BY_SPIN_ONCE))
    assert 'returned' in result.stdout, result.stderr


@pytest.fixture
def spun_soon(monkeypatch):
    """Have the listener look soon whether its node is spun; return the threads that do."""
    monkeypatch.setattr(spinning, '_UNTIL_SPUN_S', 0.2)
    threads = []
    monkeypatch.setattr(
        listener_module, 'spin_if_nobody_does',
        lambda node: threads.append(spinning.spin_if_nobody_does(node)))
    return threads


def test_node_that_nobody_spins_is_spun_with_spin_thread(node, begin, spun_soon):
    import tf2_ros
    ticked = threading.Event()
    node.create_timer(0.0, ticked.set)
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    assert ticked.wait(PATIENCE_S)
    assert node.executor is not None


def test_node_that_is_spun_is_left_to_who_spins_it(node, spin, begin, spun_soon):
    import tf2_ros
    spin(node)
    executor = node.executor
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    spun_soon[0].join(PATIENCE_S)
    assert not spun_soon[0].is_alive()
    assert node.executor is executor


def test_node_of_spin_thread_is_taken_over_by_who_spins_it_later(
        node, context, begin, spun_soon):
    import tf2_ros
    ticking = set()
    node.create_timer(0.01, lambda: ticking.add(threading.current_thread()))
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    until(lambda: spun_soon[0] in ticking)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    spin_until(executor, lambda: threading.current_thread() in ticking)
    assert node.executor is executor
    executor.shutdown()


def test_node_of_spin_thread_is_left_alone(node, begin):
    import tf2_ros
    before = len(list(node.subscriptions)), len(list(node.guards))
    begin(tf2_ros.Buffer(), node, spin_thread=True)
    assert node.executor is None
    assert (len(list(node.subscriptions)), len(list(node.guards))) == before


def test_static_listener_leaves_tf_alone(node, talker, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.StaticTransformListener(buffer, node)
    talker.fix(transform('base', 'camera'))
    buffer.lookup_transform('base', 'camera', Time(), PATIENCE)
    assert node.count_subscribers('/tf') == 0
    listener.unregister()


def test_overridden_callback_gets_every_message(node, talker, spinner):
    import tf2_ros
    heard = []

    class Listener(tf2_ros.TransformListener):
        """As people write it who want to be told."""

        def callback(self, data):
            super().callback(data)
            heard.append([transform.child_frame_id for transform in data.transforms])

    buffer = tf2_ros.Buffer()
    listener = Listener(buffer, node)
    talker.move(transform('map', 'base', 1.0), transform('base', 'arm', 1.0))
    spin_until(spinner, lambda: heard)
    assert heard == [['base', 'arm']]
    assert buffer.can_transform('map', 'arm', at(1.0))
    listener.unregister()


def test_buffer_with_its_own_set_transform_gets_every_transform(node, talker, spinner, begin):
    import tf2_ros
    heard = []

    class Spying(tf2_ros.Buffer):
        """As people write it who want to see what arrives."""

        def set_transform_static(self, transform, authority):
            heard.append(transform.child_frame_id)
            super().set_transform_static(transform, authority)

    buffer = Spying()
    begin(buffer, node)
    talker.fix(transform('base', 'camera'))
    spin_until(spinner, lambda: heard)
    assert heard == ['camera']
    assert buffer.can_transform('base', 'camera', Time())


def test_subscription_may_be_replaced(node, talker, spinner, begin):
    import tf2_ros
    buffer = tf2_ros.Buffer()
    listener = begin(buffer, node)
    assert node.destroy_subscription(listener.tf_sub)
    listener.tf_sub = node.create_subscription(TFMessage, '/robot/tf', listener.callback, 10)
    talker.send(TFMessage(transforms=[transform('map', 'base', 1.0)]), '/robot/tf')
    talker.fix(transform('base', 'camera'))
    spin_until(spinner, lambda: buffer.can_transform('map', 'camera', at(1.0)))
    assert node.count_subscribers('/tf') == 0
    listener.unregister()
    assert node.count_subscribers('/robot/tf') == node.count_subscribers('/tf_static') == 0


def test_buffer_may_be_replaced(node, talker, spinner, begin):
    import tf2_ros
    listener = begin(tf2_ros.Buffer(), node)
    for _ in range(2):
        listener.buffer = buffer = tf2_ros.Buffer()
        talker.move(transform('map', 'base', 1.0))
        spin_until(spinner, lambda: listener.buffer.can_transform('map', 'base', at(1.0)))
        assert len(buffer.frames()) == 2


def test_client_asks_a_server(make_node, spin):
    import tf2_ros
    serving = make_node('serving')
    buffer = tf2_ros.Buffer()
    buffer.set_transform(transform('map', 'base', 1.0), 'somebody')
    with (tf_tree_py.BufferServer(buffer, serving),
          tf2_ros.BufferClient(make_node('client'), 'tf2_buffer_server') as client):
        spin(serving)
        assert client.wait_for_server(PATIENCE)
        assert client.can_transform('map', 'base', at(1.0), lasting(1.0))
        with pytest.raises(tf2_ros.LookupException):
            client.lookup_transform('map', 'nowhere', at(1.0))


def test_client_takes_the_answers_of_a_server_made_by_hand(make_node, spin):
    """As tests of programs have them: services that accept, and leave the status out."""
    import tf2_ros
    serving = make_node('serving')
    kind = LookupTransform.Impl

    def accept(request, response):
        response.accepted = True
        return response

    def answer(request, response):
        response.result.transform = transform('map', 'base', 1.0, x=2.0)
        return response

    serving.create_service(kind.SendGoalService, '/mine/_action/send_goal', accept)
    serving.create_service(kind.GetResultService, '/mine/_action/get_result', answer)
    with tf2_ros.BufferClient(make_node('client'), 'mine', timeout_padding=0.0) as client:
        spin(serving)
        found = client.lookup_transform('map', 'base', Time(), PATIENCE)
        assert found.transform.translation.x == 2.0


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


LEAVES_THE_SPINNING_TO_THE_LISTENER = """
    import rclpy
    from tf2_ros import Buffer, TransformListener

    rclpy.init()
    node = rclpy.create_node('leaves_it')
    buffer = Buffer()
    listener = TransformListener(buffer, node, spin_thread=True)
    rate = node.create_rate(10)
    for _ in range(2):
        rate.sleep()
    print('slept')
"""


@pytest.mark.parametrize('end', [
    'rclpy.shutdown()', 'pass', 'raise SystemExit', 'node.destroy_node()'])
def test_program_that_nobody_spins_sleeps_and_ends(program, end):
    code = textwrap.dedent(LEAVES_THE_SPINNING_TO_THE_LISTENER) + end
    result = run('-m', 'tf_tree_py.dropin', '--force', program(code))
    assert 'slept' in result.stdout, result.stderr
    assert result.returncode == 0, result.stderr
    assert 'Traceback' not in result.stderr


def test_node_of_tf2_runs_unchanged(program):
    result = run('-m', 'tf_tree_py.dropin', '--force', program(UNCHANGED))
    assert 'found 2.2' in result.stdout, result.stderr
    assert result.returncode == 0
    assert 'Traceback' not in result.stderr
