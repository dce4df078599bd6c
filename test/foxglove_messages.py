# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Write transforms as Foxglove's messages, in every encoding in which they are read.

Transforms are (parent, child, stamp in nanoseconds, pose), as in ``bags``.
"""

from importlib.util import find_spec
import json

from bags import JAZZY, NOETIC, SECOND
import pytest
from rosbags.typesys import get_types_from_msg
from tf_tree_py.bag import Connection

TYPE = 'foxglove.FrameTransforms'
ROS_TYPE = 'foxglove_msgs/msg/FrameTransforms'
CONNECTIONS = {
    'json': Connection('/tf', TYPE, False, '', 'json'),
    'protobuf': Connection('/tf', TYPE, False, '', 'protobuf'),
    'cdr': Connection('/tf', ROS_TYPE, False, '', 'cdr'),
    'ros1': Connection('/tf', ROS_TYPE, False, '', 'ros1'),
}

_ONE_TYPE = 'foxglove_msgs/msg/FrameTransform'
_TYPES = {
    **get_types_from_msg('builtin_interfaces/Time timestamp\nstring parent_frame_id\n'
                         'string child_frame_id\ngeometry_msgs/Vector3 translation\n'
                         'geometry_msgs/Quaternion rotation\n', _ONE_TYPE),
    **get_types_from_msg('foxglove_msgs/FrameTransform[] transforms\n', ROS_TYPE),
}
for store in JAZZY, NOETIC:
    store.register(_TYPES)


def fields(parent, child, stamp, pose):
    """Return a FrameTransform as a dictionary, as it is in JSON."""
    return {
        'timestamp': dict(zip(('sec', 'nsec'), divmod(stamp, SECOND), strict=True)),
        'parent_frame_id': parent, 'child_frame_id': child,
        'translation': dict(zip('xyz', pose[:3], strict=True)),
        'rotation': dict(zip('xyzw', pose[3:], strict=True))}


def in_protobuf(parent, child, stamp, pose):
    """Return a FrameTransform of protobuf."""
    module = pytest.importorskip('foxglove_schemas_protobuf.FrameTransform_pb2')
    made = module.FrameTransform(parent_frame_id=parent, child_frame_id=child)
    made.timestamp.seconds, made.timestamp.nanos = divmod(stamp, SECOND)
    for part, axes, numbers in (('translation', 'xyz', pose[:3]), ('rotation', 'xyzw', pose[3:])):
        getattr(made, part).SetInParent()
        for axis, number in zip(axes, numbers, strict=True):
            setattr(getattr(made, part), axis, number)
    return made


def _as_json(transforms):
    return json.dumps({'transforms': [fields(*each) for each in transforms]}).encode()


def _as_protobuf(transforms):
    module = pytest.importorskip('foxglove_schemas_protobuf.FrameTransforms_pb2')
    return module.FrameTransforms(
        transforms=[in_protobuf(*each) for each in transforms]).SerializeToString()


def _in_ros(store, parent, child, stamp, pose):
    made = store.types
    return made[_ONE_TYPE](
        made['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND)), parent, child,
        made['geometry_msgs/msg/Vector3'](*pose[:3]),
        made['geometry_msgs/msg/Quaternion'](*pose[3:]))


def _as_cdr(transforms):
    message = JAZZY.types[ROS_TYPE]([_in_ros(JAZZY, *each) for each in transforms])
    return bytes(JAZZY.serialize_cdr(message, ROS_TYPE))


def _as_ros1(transforms):
    message = NOETIC.types[ROS_TYPE]([_in_ros(NOETIC, *each) for each in transforms])
    return bytes(NOETIC.serialize_ros1(message, ROS_TYPE))


ENCODERS = {'json': _as_json, 'protobuf': _as_protobuf, 'cdr': _as_cdr, 'ros1': _as_ros1}
"""For each encoding, the function that serializes transforms as FrameTransforms."""
ENCODERS_OF_ONE = {
    'json': lambda transform: json.dumps(fields(*transform)).encode(),
    'protobuf': lambda transform: in_protobuf(*transform).SerializeToString(),
    'cdr': lambda transform: bytes(JAZZY.serialize_cdr(_in_ros(JAZZY, *transform), _ONE_TYPE)),
    'ros1': lambda transform: bytes(NOETIC.serialize_ros1(_in_ros(NOETIC, *transform), _ONE_TYPE)),
}
"""For each encoding, the function that serializes one transform as a FrameTransform."""
HERE = [connection for encoding, connection in CONNECTIONS.items()
        if encoding != 'protobuf' or find_spec('foxglove_schemas_protobuf')]
"""The connections in the encodings that can be read with what is installed."""


def write_mcap(path, messages, profile='', name=TYPE, **options):
    """
    Write a file with messages as a program without ROS does; return it.

    :param messages: (received, topic, encoding, bytes) of each.
    """
    mcap = pytest.importorskip('mcap.writer')
    with path.open('wb') as file:
        writer, channels = mcap.Writer(file, **options), {}
        writer.start(profile, 'test')
        for received, topic, encoding, data in messages:
            if (topic, encoding) not in channels:
                # The schema is not needed. That of protobuf is bytes that are not text.
                schema = {'json': ('jsonschema', b'{}'), 'protobuf': ('protobuf', b'\n\xff\x80'),
                          'cdr': ('ros2msg', b''), 'ros1': ('ros1msg', b'')}.get(
                              encoding, (encoding, b''))
                channels[topic, encoding] = writer.register_channel(
                    topic, encoding, writer.register_schema(
                        ROS_TYPE if name == TYPE and encoding in ('cdr', 'ros1') else name,
                        *schema))
            writer.add_message(channels[topic, encoding], received, data, received)
        writer.finish()
    return path


def write_run(path, messages, encoding, profile='', **options):
    """Write messages of ``bags`` in one encoding; return the file."""
    return write_mcap(path.with_suffix('.mcap'), [
        (each.received, each.topic, encoding, ENCODERS[encoding](each.transforms))
        for each in messages], profile, **options)
