# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The names of tf2's packages, and their parameters."""

import importlib
import inspect

from dropin_helpers import run
from inputs import for_each
import pytest
import tf_tree_py
from tf_tree_py import dropin

pytestmark = pytest.mark.usefixtures('installed')


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


@for_each(called=[(module, name, parameters) for module, table in SIGNATURES.items()
                  for name, parameters in table.items()])
def test_name_and_arguments_are_those_of_tf2(called):
    module, name, parameters = called
    found = importlib.import_module(module)
    for part in name.split('.'):
        found = getattr(found, part)
    ours = [parameter for parameter in inspect.signature(found).parameters
            if parameter != 'self']
    assert ours[:len(parameters.split())] == parameters.split()
    # Our additional parameters are never required.
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
    # As in tf2_ros, for programs that use tf2_ros.buffer.Buffer.
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
    """Names that tf2's files import, and that programs take from there."""
    from tf2_geometry_msgs import PointStamped, PoseStamped
    from tf2_geometry_msgs.tf2_geometry_msgs import TransformStamped
    import tf2_ros
    from tf2_ros.buffer_interface import Duration, Time
    assert tf2_ros.TransformStamped is TransformStamped
    assert (tf2_ros.Duration, tf2_ros.Time) == (Duration, Time)
    assert Duration(seconds=1).nanoseconds == 10**9
    assert {cls.__module__.split('.')[0] for cls in (PointStamped, PoseStamped)} == {
        'geometry_msgs'}


def test_exceptions_are_one_family_everywhere():
    import tf2_py
    import tf2_ros
    for name in ('Connectivity', 'Lookup', 'Extrapolation', 'InvalidArgument', 'Timeout'):
        cls = getattr(tf2_ros, f'{name}Exception')
        assert cls is getattr(tf2_py, f'{name}Exception')
        assert cls is getattr(tf_tree_py, f'{name}Exception')
        assert cls.__mro__[1] is tf2_py.TransformException
    assert issubclass(tf2_py.TransformException, Exception)


def test_installing_alone_loads_no_messages():
    result = run('-m', 'tf_tree_py.dropin', '-m', 'this')
    assert 'Beautiful is better' in result.stdout, result.stderr
    loaded = 'print([name for name in sys.modules if "rclpy" in name or "msg" in name])'
    result = run('-c', f'import sys, tf_tree_py.dropin\ntf_tree_py.dropin.install()\n{loaded}')
    assert result.stdout == '[]\n', result.stderr


@pytest.mark.parametrize('use', [
    'import rclpy, tf2_ros\nrclpy.executors.SingleThreadedExecutor, rclpy.time.Time',
    'import geometry_msgs, tf2_ros\ngeometry_msgs.msg.PoseStamped'])
def test_programs_use_modules_that_only_tf2_ros_imports(use):
    result = run('-c', f'import tf_tree_py.dropin\ntf_tree_py.dropin.install(force=True)\n{use}')
    assert result.returncode == 0, result.stderr
