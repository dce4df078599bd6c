# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Reads the transforms in messages of Foxglove, and returns them as the bytes of a TFMessage.

``FrameTransform`` and ``FrameTransforms`` exist in JSON, in protobuf, and as types of ROS
(https://docs.foxglove.dev/docs/sdk/schemas/frame-transform). Missing fields mean what they mean in
Foxglove's viewer: no translation, no rotation, and 0 for a missing number.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, is_dataclass
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
_WITH_ADVICE = ('ModuleNotFoundError', 'ImportError', 'VersionError')

# The limits of one message. A transform of a few bytes takes a kilobyte once it is decoded.
_MOST_BYTES, _MOST_TRANSFORMS = 8_000_000, 100_000
# An error shows this number of characters of a wrong value, or of another library's error.
_SHOWN, _SHOWN_OF_ERROR = 60, 150


def check_decoders(path: Path, connections: Collection[Connection]) -> None:
    """
    Check that the library that decodes protobuf can be imported, if any messages need it.

    :param path: of the bag, for the error.
    :raises BagError: it is missing, or does not fit its own requirements.
    """
    for connection in connections:
        if connection.encoding == PROTOBUF and connection.has_foxglove_transforms:
            try:
                _message_class(_name_of(connection))
            # The generated code raises errors of its own: for another version of protobuf, or for
            # other definitions of the same types in this process.
            except Exception as error:  # noqa: B902
                advice = f': {_ADVICE}' if type(error).__name__ in _WITH_ADVICE else ''
                raise BagError(
                    f'{path}: reading {connection.type_name} in protobuf, on {connection.topic}, '
                    f'needs foxglove-schemas-protobuf ({error}){advice}') from error


def as_tf_message(arrival: RecordedMessage) -> bytes:
    """
    Return a message of Foxglove as a TFMessage, serialized.

    A transform without a timestamp gets the time when its message was received.

    :raises WireError: it cannot be decoded, a field has a wrong type, or it is too large.
    """
    size = len(arrival.data)
    if size > _MOST_BYTES:
        raise WireError(f'{size:,} bytes are more than the limit of {_MOST_BYTES:,}')
    transforms = _DECODERS[arrival.connection.encoding](arrival.connection, arrival.data)
    if len(transforms) > _MOST_TRANSFORMS:
        raise WireError(f'{len(transforms):,} transforms are more than the limit of '
                        f'{_MOST_TRANSFORMS:,}')
    try:
        return wire.write([_sample(_fields(each), arrival.received) for each in transforms])
    except (InvalidArgumentException, UnicodeEncodeError) as error:
        raise WireError(shorten(str(error), _SHOWN_OF_ERROR)) from None


def _name_of(connection: Connection) -> str:
    """Return the name of the type, without its package."""
    return connection.type_name.replace('/', '.').rpartition('.')[2]


def _is_single(connection: Connection) -> bool:
    return _name_of(connection) == 'FrameTransform'


# --- the encodings: each decoder returns the transforms of a message

def _from_json(connection: Connection, data: bytes) -> Sequence[object]:
    try:
        message = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise WireError(f'not JSON: {shorten(str(error), _SHOWN_OF_ERROR)}') from None
    if _is_single(connection):
        return [message]
    if not isinstance(message, dict):
        raise _wrong('the message', message, 'an object')
    if message and 'transforms' not in message:
        raise _wrong('the message', message, 'an object with transforms')
    transforms = message.get('transforms') or []
    if not isinstance(transforms, list):
        raise _wrong('transforms', transforms, 'a list')
    return transforms


def _from_protobuf(connection: Connection, data: bytes) -> Sequence[object]:
    message = _message_class(_name_of(connection))()
    try:
        message.ParseFromString(data)
    except Exception as error:  # noqa: B902 - its implementations raise their own
        raise WireError(f'not protobuf of {connection.type_name}: '
                        f'{shorten(str(error), _SHOWN_OF_ERROR)}') from None
    if _is_single(connection):
        return [message]
    if not message.transforms and len(_unknown_fields()(message)):
        raise WireError(f'not protobuf of {connection.type_name}: it has only unknown fields')
    transforms: Sequence[object] = message.transforms
    return transforms


def _from_ros(connection: Connection, data: bytes) -> Sequence[object]:
    message = decode(connection, data)
    return [message] if _is_single(connection) else message.transforms


_DECODERS: dict[str, Callable[[Connection, bytes], Sequence[object]]] = {
    JSON: _from_json, PROTOBUF: _from_protobuf, CDR: _from_ros, ROS1: _from_ros}


@cache
def _message_class(name: str) -> Any:
    return getattr(importlib.import_module(f'{_PACKAGE}.{name}_pb2'), name)


@cache
def _unknown_fields() -> Any:
    return importlib.import_module('google.protobuf.unknown_fields').UnknownFieldSet


# --- the fields of a transform, by name

_PARTS = ('translation', 'rotation')
_NAMES = {'timestamp', 'parent_frame_id', 'child_frame_id', 'transform', *_PARTS}
_SECONDS, _NANOSECONDS = ('sec', 'seconds'), ('nsec', 'nanosec', 'nanos')
"""The names of the two numbers of a timestamp: in JSON, in ROS, and in protobuf."""


def _fields(transform: Any) -> _Fields:
    if hasattr(transform, 'ListFields'):
        return {field.name: _plain(field.name, value) for field, value in transform.ListFields()}
    if is_dataclass(transform):
        return asdict(transform, dict_factory=_without_type)  # type: ignore[arg-type]
    if not isinstance(transform, dict):
        raise _wrong('a transform', transform, 'an object')
    fields = {name: value for name, value in transform.items() if value is not None}
    old = _part(fields, 'transform', ('timestamp', *_PARTS), {})  # as it was until 2022
    fields = {**old, **fields}
    unknown = [name for name in fields if name not in _NAMES]
    if unknown and not any(name in fields for name in _PARTS):
        raise WireError(f'a transform has {shorten(", ".join(unknown), _SHOWN)}, and neither a '
                        'translation nor a rotation')
    return fields


def _without_type(items: list[tuple[str, Any]]) -> dict[str, Any]:
    return {name: value for name, value in items if name != '__msgtype__'}  # which rosbags adds


def _plain(name: str, value: Any) -> object:
    """Return the value of a field of protobuf: text, or the fields that are set in a part."""
    if isinstance(value, str):
        return value
    if len(_unknown_fields()(value)):
        raise WireError(f'{name} has fields that are not in its schema, such as those of 2022')
    return {field.name: number for field, number in value.ListFields()}


# The seconds of a message of ROS have 32 bits.
_MOST_SECONDS = 2**31


def _sample(fields: _Fields, received: int) -> Sample:
    parent, child = (_text(fields, name) for name in ('parent_frame_id', 'child_frame_id'))
    if not parent and not child:
        raise WireError('a transform names no frames')
    translation = _part(fields, 'translation', 'xyz', {})
    rotation = _part(fields, 'rotation', 'xyzw', {'w': 1.0})
    timestamp = _part(fields, 'timestamp', (*_SECONDS, *_NANOSECONDS), None)
    x, y, z = (_number(translation, axis) for axis in 'xyz')
    qx, qy, qz, qw = (_number(rotation, axis) for axis in 'xyzw')
    stamp = received if timestamp is None else _stamp(timestamp)
    return Sample(parent, child, stamp, (x, y, z, qx, qy, qz, qw))


def _part(fields: _Fields, name: str, known: Collection[str], default: Any) -> Any:
    """Return a part of a transform; the default if it is missing."""
    part = fields.get(name)
    if part is None:
        return default
    if not isinstance(part, dict) or not part.keys() <= set(known):
        raise _wrong(name, part, f'an object of {", ".join(known)}')
    return part


def _text(fields: _Fields, name: str) -> str:
    text = fields.get(name)
    if text is None:
        return ''
    if not isinstance(text, str):
        raise _wrong(name, text, 'text')
    return text


def _number(fields: _Fields, name: str) -> float:
    number = fields.get(name)
    if number is None:
        return 0.0
    if isinstance(number, bool) or not isinstance(number, (int, float)):
        raise _wrong(name, number, 'a number')
    try:
        return float(number)
    except OverflowError:
        raise _wrong(name, number, 'a float') from None


def _stamp(timestamp: _Fields) -> int:
    seconds, nanoseconds = (_integer(timestamp, names) for names in (_SECONDS, _NANOSECONDS))
    if not -_MOST_SECONDS <= seconds < _MOST_SECONDS:
        raise _wrong('the seconds of a timestamp', seconds, 'from 1901 to 2038')
    if not 0 <= nanoseconds < NANOSECONDS_PER_SECOND:
        raise _wrong('the nanoseconds of a timestamp', nanoseconds, 'below a second')
    return seconds * NANOSECONDS_PER_SECOND + nanoseconds


def _integer(fields: _Fields, names: Collection[str]) -> int:
    number = next((fields[name] for name in names if fields.get(name) is not None), 0)
    if isinstance(number, bool) or not isinstance(number, int):
        raise _wrong('a timestamp', number, 'in integers')
    return number


def _wrong(what: str, value: object, expected: str) -> WireError:
    try:
        shown = shorten(repr(value), _SHOWN)
    except RecursionError:  # it is nested nearly as deep as the parser allows
        shown = 'deeply nested'
    return WireError(f'{what} is {shown}, not {expected}')
