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
from tf_tree_py import Buffer, TransformBroadcaster, TransformListener

REQUIRED = inspect.Parameter.empty


class OtherBuffer:
    """Like a buffer of tf2, it has other methods than ours."""


def parameters(function):
    """Return the parameters for tf2's callers with their defaults, durations in nanoseconds."""
    return {name: getattr(parameter.default, 'nanoseconds', parameter.default)
            for name, parameter in inspect.signature(function).parameters.items()
            if name != 'self'}


def run(program):
    """Run a program in a new process; return what it printed, read as a Python value."""
    done = subprocess.run([sys.executable, '-c', textwrap.dedent(program)], capture_output=True,
                          text=True, timeout=PATIENCE_S, check=False)
    assert (done.returncode, done.stderr) == (0, '')
    return ast.literal_eval(done.stdout)


def test_public_names_are_there_once_in_order_and_in_a_star_import():
    names = {}
    exec('from tf_tree_py import *', names)
    assert set(tf_tree_py.__all__) <= names.keys() & set(dir(tf_tree_py))
    assert None not in [getattr(tf_tree_py, name) for name in tf_tree_py.__all__]
    assert tf_tree_py.__all__ == sorted(set(tf_tree_py.__all__), key=str.lower)


def test_type_checkers_are_told_of_what_is_loaded_late():
    """They do not run ``__getattr__``: without visible imports, every class would be Any."""
    [block] = [node for node in ast.parse(inspect.getsource(tf_tree_py)).body
               if isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING']
    assert {alias.name: node.module.removeprefix('tf_tree_py.ros.')
            for node in block.body for alias in node.names} == tf_tree_py._ROS_NAMES


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


def test_without_ros_the_core_works_and_a_sentence_says_what_to_install():
    sentences, names = run("""
        import sys

        class Blocker:
            def find_spec(self, name, path=None, target=None):
                if name.split('.')[0] in {'rclpy', 'geometry_msgs', 'tf2_msgs', 'std_msgs'}:
                    raise ModuleNotFoundError(f'No module named {name!r}', name=name)

        sys.meta_path.insert(0, Blocker())
        import tf_tree_py

        assert tf_tree_py.BufferCore().frames() == []
        sentences, names = {}, {}
        for name in tf_tree_py._ROS_NAMES:
            try:
                getattr(tf_tree_py, name)
            except ImportError as error:
                sentences[name] = str(error)
        exec('from tf_tree_py import *', names)
        print((sentences, sorted(names.keys() - {'__builtins__'})))
    """)
    assert 'TransformListener' in tf_tree_py._ROS_NAMES
    assert sentences.keys() == set(tf_tree_py._ROS_NAMES)
    for name, sentence in sentences.items():
        assert sentence.startswith(f'tf_tree_py.{name} needs ROS 2, and ')
        assert ' is not installed: source a ROS 2 installation, or run scripts/setup' in sentence
    assert {'BufferCore', 'Pose', 'lookup_twist', 'TransformException'} <= set(names)
    assert set(names) == set(tf_tree_py.__all__) - set(tf_tree_py._ROS_NAMES)


def test_package_imports_ros_only_when_a_name_needs_it():
    imported, names = run("""
        import sys, tf_tree_py
        imported, names = 'rclpy' in sys.modules, {}
        exec('from tf_tree_py import *', names)
        print((imported, sorted(names.keys() - {'__builtins__'})))
    """)
    assert not imported
    assert set(names) == set(tf_tree_py.__all__)
    assert {'Buffer', 'TransformListener', 'MessageFilter'} < set(names)


FRAMES = {'target_frame': REQUIRED, 'source_frame': REQUIRED}
ONE_TIME = {**FRAMES, 'time': REQUIRED, 'timeout': 0}
TWO_TIMES = {'target_frame': REQUIRED, 'target_time': REQUIRED, 'source_frame': REQUIRED,
             'source_time': REQUIRED, 'fixed_frame': REQUIRED, 'timeout': 0}


@for_each(method_and_parameters=[
    (Buffer.lookup_transform, ONE_TIME),
    (Buffer.lookup_transform_full, TWO_TIMES),
    (Buffer.can_transform, {**ONE_TIME, 'return_debug_tuple': False}),
    (Buffer.can_transform_full, {**TWO_TIMES, 'return_debug_tuple': False}),
    (Buffer.get_latest_common_time, FRAMES),
    (Buffer.all_frames_as_yaml, {}),
    (Buffer.all_frames_as_string, {}),
    (Buffer.clear, {}),
    (TransformListener.unregister, {}),
    (TransformBroadcaster.sendTransform, {'transform': REQUIRED}),
    (tf_tree_py.StaticTransformBroadcaster.sendTransform, {'transform': REQUIRED}),
])
def test_methods_have_the_parameters_of_tf2(method_and_parameters):
    method, expected = method_and_parameters
    assert list(parameters(method).items()) == list(expected.items())
    if 'timeout' in expected:
        assert inspect.signature(method).parameters['timeout'].default == Duration()


def test_objects_are_made_as_in_tf2():
    names = parameters(Buffer)
    assert list(names)[:2] == ['cache_time', 'node']
    assert names['cache_time'] is names['node'] is None
    assert issubclass(Buffer, tf_tree_py.BufferCore)
    for method in (Buffer.set_transform, Buffer.set_transform_static):
        assert list(parameters(method)) == ['transform', 'authority']
    for kind in (TransformBroadcaster, tf_tree_py.StaticTransformBroadcaster):
        first, second, *ours = parameters(kind).items()
        assert (first, second) == (('node', REQUIRED), ('qos', None))
        assert REQUIRED not in dict(ours).values()

    positional = [name for name, parameter in inspect.signature(
        TransformListener).parameters.items() if parameter.kind is parameter.POSITIONAL_OR_KEYWORD]
    assert positional == ['buffer', 'node']
    # In tf2 the default of spin_thread is False, and True spins the user's node; ours never does.
    assert parameters(TransformListener).items() >= {
        'qos': None, 'static_qos': None, 'tf_topic': '/tf', 'tf_static_topic': '/tf_static',
        'static_only': False, 'spin_thread': True}.items()


@for_each(make=[
    TransformListener, tf_tree_py.BufferServer, tf_tree_py.TransformDiagnostics,
    lambda buffer, node: tf_tree_py.MessageFilter(buffer, node, 'map', print)
], swapped_and_sentence=[
    (False, r'a Buffer of tf_tree_py, and this is a test_public_api\.OtherBuffer: create it with '
            '`from tf_tree_py import Buffer`'),
    (True, r'a Buffer of tf_tree_py, and this is a rclpy\.node\.Node: the buffer comes first'),
])
def test_buffer_of_somebody_else_is_refused(node, make, swapped_and_sentence):
    swapped, sentence = swapped_and_sentence
    before = len(list(node.subscriptions)), len(list(node.services))
    with pytest.raises(TypeError, match=sentence):
        make(*((node, Buffer()) if swapped else (OtherBuffer(), node)))
    assert (len(list(node.subscriptions)), len(list(node.services))) == before


# --- help(Buffer)

FOR_THE_PACKAGE = {
    'alarm_clock', 'begin_feed', 'end_feed', 'fail_waiters', 'fed_by', 'forget_orphans',
    'leave_orphan', 'log_to', 'name_later', 'no_longer_fed_by', 'note', 'observe',
    'refuse', 'sleep_until_waited_for', 'unobserve', 'wake_everybody'}


def test_what_only_the_package_calls_is_not_here_but_in_objects_of_its_own():
    assert not {name.lstrip('_') for name in dir(Buffer)} & FOR_THE_PACKAGE


def test_whatever_is_public_says_what_it_does():
    undocumented = [name for name in dir(Buffer) if not name.startswith('_')
                    and not (getattr(Buffer, name).__doc__ or '').strip()]
    assert undocumented == []


def test_a_buffer_is_what_users_take_it_for_and_no_heap_of_parts():
    assert issubclass(Buffer, tf_tree_py.BufferInterface)
    for kind in Buffer.__mro__:
        declared = vars(kind).get('__annotations__', {})
        assert declared.keys() <= vars(kind).keys(), f'{kind} declares what another class sets'
    # help() groups related methods: lookups of one pose, other lookups, the core's buffer,
    # tf2_py's methods, the interface that the client shares, tf2's buffer, object.
    assert len(Buffer.__mro__) <= 7
