# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The public imports, and their compatibility with tf2."""

import ast
from importlib import import_module
import inspect
import sys
import textwrap

from inputs import for_each
from programs import completed, without
import pytest
import tf_tree_py
from tf_tree_py import Buffer, TransformBroadcaster, TransformListener


class OtherBuffer:
    """Like a buffer of tf2, it has other methods than ours."""


def parameters(function):
    """Return the parameters for tf2's callers with their defaults, durations in nanoseconds."""
    return ' '.join(
        name if parameter.default is parameter.empty
        else f'{name}={getattr(parameter.default, "nanoseconds", parameter.default)}'
        for name, parameter in inspect.signature(function).parameters.items()
        if name != 'self' and parameter.kind is parameter.POSITIONAL_OR_KEYWORD)


def run(program, *missing):
    """Run a program without some packages; return what it printed, read as a Python value."""
    done = completed(sys.executable, '-c', without(*missing) + textwrap.dedent(program))
    assert (done.returncode, done.stderr) == (0, '')
    return ast.literal_eval(done.stdout)


def test_public_names_are_there_once_in_order_and_in_a_star_import():
    names = {}
    exec('from tf_tree_py import *', names)
    assert set(tf_tree_py.__all__) <= names.keys() & set(dir(tf_tree_py))
    assert None not in [getattr(tf_tree_py, name) for name in tf_tree_py.__all__]
    assert tf_tree_py.__all__ == sorted(set(tf_tree_py.__all__), key=str.lower)


def loaded_late():
    """Return the names that are loaded on first use, with their modules, as type checkers see."""
    [block] = [node for node in ast.parse(inspect.getsource(tf_tree_py)).body
               if isinstance(node, ast.If) and ast.unparse(node.test) == 'TYPE_CHECKING']
    return {alias.name: node.module for node in block.body for alias in node.names}


def test_type_checkers_are_told_of_what_is_loaded_late():
    """They do not run ``__getattr__``: without visible imports, every class would be Any."""
    bound = run('import tf_tree_py; print(list(vars(tf_tree_py)))')
    assert loaded_late().keys() == set(tf_tree_py.__all__) - set(bound)
    for name, module in loaded_late().items():
        assert getattr(tf_tree_py, name) is getattr(import_module(module), name)


def test_what_is_loaded_on_first_use_is_not_loaded_before():
    loaded = run('import sys, tf_tree_py; print(list(sys.modules))')
    assert not set(loaded_late().values()) & set(loaded)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'tf_tree_py' has no attribute 'Bufer'"):
        _ = tf_tree_py.Bufer
    assert not hasattr(tf_tree_py, 'Bufer')


def test_without_ros_the_core_works_and_a_sentence_says_what_to_install():
    of_ros = {name for name, module in loaded_late().items()
              if module.startswith('tf_tree_py.ros.')}
    sentences, names = run(f"""
        import tf_tree_py

        assert tf_tree_py.BufferCore().frames() == []
        sentences, names = {{}}, {{}}
        for name in {list(loaded_late())}:
            try:
                getattr(tf_tree_py, name)
            except ImportError as error:
                sentences[name] = str(error)
        exec('from tf_tree_py import *', names)
        print((sentences, sorted(names.keys() - {{'__builtins__'}})))
    """, 'rclpy', 'geometry_msgs', 'tf2_msgs', 'std_msgs')
    assert 'TransformListener' in of_ros
    assert sentences.keys() == of_ros
    for name, sentence in sentences.items():
        assert sentence.startswith(f'tf_tree_py.{name} needs ROS 2, and ')
        assert ' is not installed: source a ROS 2 installation, or run scripts/setup' in sentence
    assert {'BufferCore', 'Pose', 'lookup_twist', 'TransformException'} <= set(names)
    assert set(names) == set(tf_tree_py.__all__) - of_ros


def test_package_imports_ros_only_when_a_name_needs_it():
    assert run('import sys, tf_tree_py; print("rclpy" in sys.modules)') is False


FRAMES = 'target_frame source_frame'
FULL = 'target_frame target_time source_frame source_time fixed_frame'


@for_each(function_and_parameters=[
    (Buffer, 'cache_time=None node=None'),
    (Buffer.lookup_transform, f'{FRAMES} time timeout=0'),
    (Buffer.lookup_transform_full, f'{FULL} timeout=0'),
    (Buffer.can_transform, f'{FRAMES} time timeout=0 return_debug_tuple=False'),
    (Buffer.can_transform_full, f'{FULL} timeout=0 return_debug_tuple=False'),
    (Buffer.get_latest_common_time, FRAMES),
    (Buffer.all_frames_as_yaml, ''),
    (Buffer.all_frames_as_string, ''),
    (Buffer.clear, ''),
    (Buffer.set_transform, 'transform authority=default_authority'),
    (Buffer.set_transform_static, 'transform authority=default_authority'),
    (TransformListener, 'buffer node=None'),
    (TransformListener.unregister, ''),
    (TransformBroadcaster, 'node qos=None'),
    (TransformBroadcaster.sendTransform, 'transform'),
    (tf_tree_py.StaticTransformBroadcaster, 'node qos=None'),
    (tf_tree_py.StaticTransformBroadcaster.sendTransform, 'transform'),
])
def test_classes_and_methods_have_the_parameters_of_tf2(function_and_parameters):
    function, expected = function_and_parameters
    assert parameters(function) == expected
    more = [parameter for parameter in inspect.signature(function).parameters.values()
            if parameter.kind is parameter.KEYWORD_ONLY]
    assert inspect.Parameter.empty not in [parameter.default for parameter in more]


def test_listener_has_the_defaults_of_tf2_and_spins():
    """In tf2 the default of spin_thread is False, and True spins the user's node; ours never."""
    options = inspect.signature(TransformListener).parameters
    assert [options[name].default for name in (
        'qos', 'static_qos', 'tf_topic', 'tf_static_topic', 'static_only', 'spin_thread')] == [
            None, None, '/tf', '/tf_static', False, True]


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
    assert issubclass(Buffer, tf_tree_py.BufferCore)
    for kind in Buffer.__mro__:
        declared = vars(kind).get('__annotations__', {})
        assert declared.keys() <= vars(kind).keys(), f'{kind} declares what another class sets'
    # help() groups related methods by class: lookups, the tree, and insertion; the queries and the
    # insertion of each feature that tf2 does not have; tf2_py's methods, the interface that the
    # client shares, tf2's buffer. Only the class that assembles them adds nothing.
    empty = [kind for kind in Buffer.__mro__
             if all(name.startswith('_') for name in vars(kind))]
    assert empty == [tf_tree_py.BufferCore, object]
