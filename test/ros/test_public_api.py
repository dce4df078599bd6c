# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The public imports, and their compatibility with tf2."""

import ast
import inspect
import subprocess
import sys
import textwrap

from inputs import for_each
from programs import PATIENCE_S
import pytest
from rclpy.duration import Duration
import tf_tree_py
from tf_tree_py import (
    Buffer,
    BufferCore,
    BufferServer,
    MessageFilter,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformDiagnostics,
    TransformListener,
)

REQUIRED = inspect.Parameter.empty


class OtherBuffer:
    """Like a buffer of tf2, it has other methods than ours."""


def parameters(function):
    """Return the parameters for tf2's callers with their defaults, durations in nanoseconds."""
    return {name: getattr(parameter.default, 'nanoseconds', parameter.default)
            for name, parameter in inspect.signature(function).parameters.items()
            if name != 'self'}


def run_without_rclpy(code):
    blocker = """
        import sys

        class Blocker:
            def find_spec(self, name, path=None, target=None):
                if name.split('.')[0] in {'rclpy', 'geometry_msgs', 'tf2_msgs', 'std_msgs'}:
                    raise ModuleNotFoundError(f'No module named {name!r}', name=name)

        sys.meta_path.insert(0, Blocker())
    """
    return subprocess.run(
        [sys.executable, '-c', textwrap.dedent(blocker) + textwrap.dedent(code)],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False)


@for_each(name=tf_tree_py.__all__)
def test_every_public_name_is_there(name):
    assert getattr(tf_tree_py, name) is not None
    assert name in dir(tf_tree_py)


def test_type_checkers_are_told_of_what_is_loaded_late():
    """They do not run ``__getattr__``: without visible imports, every class would be Any."""
    [block] = [node for node in ast.parse(inspect.getsource(tf_tree_py)).body
               if isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING']
    assert {alias.name: node.module.removeprefix('tf_tree_py.ros.')
            for node in block.body for alias in node.names} == tf_tree_py._ROS_NAMES


def test_public_names_are_listed_once_and_in_order():
    assert tf_tree_py.__all__ == sorted(set(tf_tree_py.__all__), key=str.lower)


def test_star_import_gives_the_public_names():
    names = {}
    exec('from tf_tree_py import *', names)
    assert set(tf_tree_py.__all__) <= names.keys()


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'tf_tree_py' has no attribute 'Bufer'"):
        _ = tf_tree_py.Bufer
    assert not hasattr(tf_tree_py, 'Bufer')


def test_old_name_loads_what_needs_ros_under_its_present_name(monkeypatch):
    monkeypatch.setitem(tf_tree_py._OLD_NAMES, 'Listener', 'TransformListener')
    with pytest.warns(DeprecationWarning, match=r'use tf_tree_py\.TransformListener') as caught:
        from tf_tree_py import Listener
    assert Listener is tf_tree_py.TransformListener
    assert caught[0].filename == __file__


def test_without_ros_one_sentence_says_what_to_install():
    done = run_without_rclpy("""
        import tf_tree_py

        assert tf_tree_py.BufferCore().frames() == []
        for name in tf_tree_py._ROS_NAMES:
            try:
                getattr(tf_tree_py, name)
            except ImportError as error:
                print(error)
    """)
    assert (done.returncode, done.stderr) == (0, '')
    assert 'TransformListener' in tf_tree_py._ROS_NAMES
    for name, line in zip(tf_tree_py._ROS_NAMES, done.stdout.splitlines(), strict=True):
        assert line.startswith(f'tf_tree_py.{name} needs ROS 2, and ')
        assert ' is not installed: source a ROS 2 installation, or run scripts/setup' in line


def test_star_import_takes_what_can_be_had():
    program = textwrap.dedent("""
        names = {}
        exec('from tf_tree_py import *', names)
        print(sorted(names.keys() - {'__builtins__'}))
    """)
    without = run_without_rclpy(program)
    assert (without.returncode, without.stderr) == (0, '')
    names = ast.literal_eval(without.stdout)
    assert {'BufferCore', 'Pose', 'lookup_twist', 'TransformException'} <= set(names)
    assert set(names) == set(tf_tree_py.__all__) - set(tf_tree_py._ROS_NAMES)
    everything = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                                timeout=PATIENCE_S, check=True)
    assert set(ast.literal_eval(everything.stdout)) == set(tf_tree_py.__all__)
    assert {'Buffer', 'TransformListener', 'MessageFilter'} < set(tf_tree_py.__all__)


def test_importing_the_package_does_not_import_ros():
    done = subprocess.run(
        [sys.executable, '-c', 'import sys, tf_tree_py; print("rclpy" in sys.modules)'],
        capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    assert done.stdout.strip() == 'False'


def test_buffer_is_made_as_in_tf2():
    names = parameters(Buffer)
    assert list(names)[:2] == ['cache_time', 'node']
    assert names['cache_time'] is names['node'] is None
    assert issubclass(Buffer, BufferCore)


@pytest.mark.parametrize(('method', 'expected'), [
    ('lookup_transform',
     {'target_frame': REQUIRED, 'source_frame': REQUIRED, 'time': REQUIRED, 'timeout': 0}),
    ('lookup_transform_full',
     {'target_frame': REQUIRED, 'target_time': REQUIRED, 'source_frame': REQUIRED,
      'source_time': REQUIRED, 'fixed_frame': REQUIRED, 'timeout': 0}),
    ('can_transform',
     {'target_frame': REQUIRED, 'source_frame': REQUIRED, 'time': REQUIRED, 'timeout': 0,
      'return_debug_tuple': False}),
    ('can_transform_full',
     {'target_frame': REQUIRED, 'target_time': REQUIRED, 'source_frame': REQUIRED,
      'source_time': REQUIRED, 'fixed_frame': REQUIRED, 'timeout': 0,
      'return_debug_tuple': False}),
    ('get_latest_common_time', {'target_frame': REQUIRED, 'source_frame': REQUIRED}),
    ('all_frames_as_yaml', {}),
    ('all_frames_as_string', {}),
    ('clear', {}),
])
def test_buffer_is_asked_as_in_tf2(method, expected):
    names = parameters(getattr(Buffer, method))
    assert names == expected
    assert list(names) == list(expected)


def test_timeout_defaults_to_an_empty_duration():
    default = inspect.signature(Buffer.lookup_transform).parameters['timeout'].default
    assert default == Duration()


@pytest.mark.parametrize('method', ['set_transform', 'set_transform_static'])
def test_transforms_are_set_as_in_tf2(method):
    names = parameters(getattr(Buffer, method))
    assert list(names) == ['transform', 'authority']


def test_listener_is_made_as_in_tf2():
    signature = inspect.signature(TransformListener)
    positional = [name for name, parameter in signature.parameters.items()
                  if parameter.kind is parameter.POSITIONAL_OR_KEYWORD]
    assert positional == ['buffer', 'node']
    names = parameters(TransformListener)
    assert names['qos'] is names['static_qos'] is None
    assert (names['tf_topic'], names['tf_static_topic']) == ('/tf', '/tf_static')
    assert names['static_only'] is False
    # In tf2 the default is False, and True spins the user's node; ours never does that.
    assert names['spin_thread'] is True
    assert parameters(TransformListener.unregister) == {}


@pytest.mark.parametrize('kind', [TransformBroadcaster, StaticTransformBroadcaster])
def test_broadcasters_are_made_and_used_as_in_tf2(kind):
    first, second, *ours = parameters(kind).items()
    assert (first, second) == (('node', REQUIRED), ('qos', None))
    assert REQUIRED not in dict(ours).values()
    assert parameters(kind.sendTransform) == {'transform': REQUIRED}


@pytest.mark.parametrize('make', [
    TransformListener, BufferServer, TransformDiagnostics,
    lambda buffer, node: MessageFilter(buffer, node, 'map', print)],
    ids=['TransformListener', 'BufferServer', 'TransformDiagnostics', 'MessageFilter'])
@pytest.mark.parametrize(('swapped', 'sentence'), [
    (False, r'a Buffer of tf_tree_py, and this is a test_public_api\.OtherBuffer: create it with '
            '`from tf_tree_py import Buffer`'),
    (True, r'a Buffer of tf_tree_py, and this is a rclpy\.node\.Node: the buffer comes first'),
])
def test_buffer_of_somebody_else_is_refused(node, make, swapped, sentence):
    arguments = (node, Buffer()) if swapped else (OtherBuffer(), node)
    before = len(list(node.subscriptions)), len(list(node.services))
    with pytest.raises(TypeError, match=sentence):
        make(*arguments)
    assert (len(list(node.subscriptions)), len(list(node.services))) == before
