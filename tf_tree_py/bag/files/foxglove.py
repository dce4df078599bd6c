# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads the transforms in messages of Foxglove, and returns them as the bytes of a TFMessage.

``FrameTransform`` and ``FrameTransforms`` exist in JSON, in protobuf, and as types of ROS
(https://docs.foxglove.dev/docs/sdk/schemas/frame-transform). Missing fields mean what they mean in
Foxglove's viewer: no translation, no rotation, and 0 for a missing number.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict
from functools import cache
import importlib
import json
from pathlib import Path
from typing import Any

from tf_tree_py.core.errors import InvalidArgumentException
from tf_tree_py.core.messages import wire
from tf_tree_py.core.messages.byte_cursor import WireError
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.core.text import shorten
from tf_tree_py.recording.errors import BagError

from .connections import CDR, Connection, decode, JSON, PROTOBUF, RecordedMessage, ROS1

_Fields = Mapping[str, Any]

_PACKAGE = 'foxglove_schemas_protobuf'
# Its generated code refuses older ones, which its metadata allows.
_ADVICE = "pip install foxglove-schemas-protobuf 'protobuf>=5.29.6'"

# An error shows this number of characters of a wrong value.
_SHOWN = 60


def check_decoders(path: Path, connections: Collection[Connection]) -> None:
    """
    Check that the library is installed that decodes protobuf, if some messages are in it.

    :param path: of the bag, for the error.
    :raises BagError: it is not, or it cannot be imported.
    """
    for connection in connections:
        if connection.encoding == PROTOBUF and connection.has_foxglove_transforms:
            try:
                _message_class(_name_of(connection))
            # Generated code raises errors of its own for a version that it does not fit.
            except Exception as error:  # noqa: B902
                raise BagError(
                    f'{path}: reading {connection.type_name} in protobuf, on {connection.topic}, '
                    f'needs foxglove-schemas-protobuf ({error}): {_ADVICE}') from error


def as_tf_message(arrival: RecordedMessage) -> bytes:
    """
    Return a message of Foxglove as a TFMessage, serialized.

    A transform without a timestamp gets the time when its message was received.

    :raises WireError: it cannot be decoded, or a field has a wrong type.
    """
    connection = arrival.connection
    fields = _DECODERS[connection.encoding](connection, arrival.data)
    transforms = [fields]
    if _name_of(connection) == 'FrameTransforms':
        transforms = fields.get('transforms') or []
        if not isinstance(transforms, list):
            raise _wrong('transforms', transforms, 'a list')
    try:
        return wire.write([_sample(each, arrival.received) for each in transforms])
    except (InvalidArgumentException, UnicodeEncodeError) as error:
        raise WireError(str(error)) from None


def _name_of(connection: Connection) -> str:
    """Return the name of the type, without its package."""
    return connection.type_name.replace('/', '.').rpartition('.')[2]


# --- the encodings: each decoder returns the fields by name, nested as in the schema

def _from_json(_: Connection, data: bytes) -> _Fields:
    try:
        fields = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise WireError(f'not JSON: {error}') from None
    if not isinstance(fields, dict):
        raise _wrong('the message', fields, 'an object')
    return fields


def _from_protobuf(connection: Connection, data: bytes) -> _Fields:
    made = _message_class(_name_of(connection))()
    try:
        made.ParseFromString(data)
    except Exception as error:  # noqa: B902 - its implementations raise their own
        raise WireError(f'not protobuf of {connection.type_name}: {error}') from None
    return _plain(made)


def _plain(message: Any) -> _Fields:
    """Return the fields of a message that are set."""
    return {field.name: _plain_value(value) for field, value in message.ListFields()}


def _plain_value(value: Any) -> object:
    if hasattr(value, 'ListFields'):
        return _plain(value)
    return value if isinstance(value, (int, float, str)) else [_plain(each) for each in value]


@cache
def _message_class(name: str) -> Any:
    return getattr(importlib.import_module(f'{_PACKAGE}.{name}_pb2'), name)


def _from_ros(connection: Connection, data: bytes) -> _Fields:
    return asdict(decode(connection, data))


_DECODERS: dict[str, Callable[[Connection, bytes], _Fields]] = {
    JSON: _from_json, PROTOBUF: _from_protobuf, CDR: _from_ros, ROS1: _from_ros}


# --- the fields

_SECONDS, _NANOSECONDS = ('sec', 'seconds'), ('nsec', 'nanosec', 'nanos')
"""The names of the two numbers of a timestamp: in JSON, in ROS, and in protobuf."""


def _sample(transform: object, received: int) -> Sample:
    if not isinstance(transform, Mapping):
        raise _wrong('a transform', transform, 'an object')
    parent, child = (_text(transform, name) for name in ('parent_frame_id', 'child_frame_id'))
    translation = _part(transform, 'translation', {})
    rotation = _part(transform, 'rotation', {'w': 1.0})
    stamp = received
    if transform.get('timestamp') is not None:
        stamp = _stamp(_part(transform, 'timestamp', {}))
    x, y, z = (_number(translation, axis) for axis in 'xyz')
    qx, qy, qz, qw = (_number(rotation, axis) for axis in 'xyzw')
    return Sample(parent, child, stamp, (x, y, z, qx, qy, qz, qw))


def _part(fields: _Fields, name: str, default: _Fields) -> _Fields:
    part = fields.get(name)
    if part is None:
        return default
    if not isinstance(part, Mapping):
        raise _wrong(name, part, 'an object')
    return part


def _text(fields: _Fields, name: str) -> str:
    text = fields.get(name, '')
    if not isinstance(text, str):
        raise _wrong(name, text, 'text')
    return text


def _number(fields: _Fields, name: str) -> float:
    number = fields.get(name, 0.0)
    if isinstance(number, bool) or not isinstance(number, (int, float)):
        raise _wrong(name, number, 'a number')
    try:
        return float(number)
    except OverflowError:
        raise _wrong(name, number, 'a float') from None


def _stamp(timestamp: _Fields) -> int:
    seconds, nanoseconds = (_integer(timestamp, names) for names in (_SECONDS, _NANOSECONDS))
    if not 0 <= nanoseconds < NANOSECONDS_PER_SECOND:
        raise _wrong('the nanoseconds of a timestamp', nanoseconds, 'below a second')
    return seconds * NANOSECONDS_PER_SECOND + nanoseconds


def _integer(fields: _Fields, names: Collection[str]) -> int:
    number = next((fields[name] for name in names if name in fields), 0)
    if isinstance(number, bool) or not isinstance(number, int):
        raise _wrong('a timestamp', number, 'in integers')
    return number


def _wrong(what: str, value: object, expected: str) -> WireError:
    return WireError(f'{what} is {shorten(repr(value), _SHOWN)}, not {expected}')
