# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The registry of types that users want to transform and convert, as tf2 has it.

The names and their behaviour are tf2's. The messages of ``do_transform`` need no registration; a
function that is registered for one of their types takes precedence.
"""

from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any, TypeVar

from geometry_msgs import msg as geometry_msgs
from rclpy.time import Time
from std_msgs.msg import Header
from tf_tree_py.core.errors import join, JoinableException

from .convert import as_nanoseconds, time_message, TimeLike
from .do_transform import Transformer, TRANSFORMERS

_Converter = Callable[[Any], Any]
Object = TypeVar('Object')

# tf2 has one registry for the whole process, and so has this module.
_transformers: dict[type, Transformer] = {}
_from_msg: dict[type, _Converter] = {}
_to_msg: dict[type, _Converter] = {}
_converters: dict[tuple[type, type], _Converter] = {}

_FIELDS = {
    'Point': 'point', 'Vector3': 'vector', 'Quaternion': 'quaternion', 'Pose': 'pose',
    'PoseWithCovariance': 'pose', 'Transform': 'transform', 'Polygon': 'polygon',
    'PolygonInstance': 'polygon', 'Wrench': 'wrench', 'Twist': 'twist',
    'TwistWithCovariance': 'twist', 'Accel': 'accel', 'AccelWithCovariance': 'accel'}

STAMPED_FORMS: Mapping[type, tuple[type, str]] = {
    getattr(geometry_msgs, name): (getattr(geometry_msgs, f'{name}Stamped'), field)
    for name, field in _FIELDS.items()}
"""The message with a header that holds one without, and the field it is in."""


class TypeException(JoinableException):
    """An object's type has no registered function that transforms or converts it."""

    def __init__(self, errstr: str) -> None:
        _init(self, errstr)


class NotImplementedException(JoinableException):
    """A buffer interface does not implement the method that was called."""

    def __init__(self) -> None:
        _init(self, 'CanTransform or LookupTransform not implemented')


def _init(error: Any, errstr: str) -> None:
    join('tf2_ros', (TypeException, NotImplementedException))
    # Not super(): after join() that may be tf2's class, whose __init__ takes other arguments.
    Exception.__init__(error, errstr)
    error.errstr = errstr


class TransformRegistration:
    """The registered transform functions by type; one registry for all instances."""

    def print_me(self) -> None:
        """Print the registry."""
        print({**TRANSFORMERS, **_transformers})

    def add(self, key: type, callback: Transformer) -> None:
        """
        Register the function that transforms objects of a type.

        :param callback: takes (object, ``TransformStamped``) and returns a new object.
        """
        _transformers[key] = callback

    def get(self, key: type) -> Transformer:
        """
        Return the function that transforms objects of a type.

        :raises TypeException: none is registered.
        """
        transformer = _transformers.get(key) or TRANSFORMERS.get(key)
        if transformer is None:
            ready = ', '.join(cls.__name__ for cls in TRANSFORMERS)
            raise TypeException(
                f'Type {key} is not loaded or supported: register how to transform it with '
                'TransformRegistration().add(type, function), where the function takes an object '
                f'and a TransformStamped. Ready without that: {ready}')
        return transformer


class ConvertRegistration:
    """The registered conversions between types; one registry for all instances."""

    def add_from_msg(self, key: type, callback: _Converter) -> None:
        """Register the function that makes an object of a type from a message."""
        _from_msg[key] = callback

    def add_to_msg(self, key: type, callback: _Converter) -> None:
        """Register the function that makes a message from an object of a type."""
        _to_msg[key] = callback

    def add_convert(self, key: tuple[type, type], callback: _Converter) -> None:
        """Register the function that converts the first type to the second directly."""
        _converters[key] = callback

    def get_from_msg(self, key: type) -> _Converter:
        """
        Return the function that makes an object of a type from a message.

        :raises TypeException: none is registered.
        """
        if key in TRANSFORMERS:
            return _from_msg.get(key, lambda message: _checked(message, key))
        return _found(_from_msg, key, 'add_from_msg')

    def get_to_msg(self, key: type) -> _Converter:
        """
        Return the function that makes a message from an object of a type.

        :raises TypeException: none is registered.
        """
        if key in TRANSFORMERS:
            return _to_msg.get(key, _itself)
        return _found(_to_msg, key, 'add_to_msg')

    def get_convert(self, key: tuple[type, type]) -> _Converter:
        """
        Return the function that converts the first type to the second directly.

        :raises TypeException: none is registered.
        """
        if key not in _converters:
            raise TypeException(f'Type {key} is not loaded or supported')
        return _converters[key]


def _found(registry: dict[type, _Converter], key: type, fix: str) -> _Converter:
    if key not in registry:
        raise TypeException(f'Type {key} is not loaded or supported: register how to convert '
                            f'it with ConvertRegistration().{fix}(type, function)')
    return registry[key]


def _itself(message: Object) -> Object:
    return message


def _checked(message: object, cls: type[Object]) -> Object:
    if not isinstance(message, cls):
        raise TypeException(
            f'A {type(message).__name__} cannot be converted to a {cls.__name__}: register how '
            'with ConvertRegistration().add_convert((type, type), function)')
    return message


def convert(a: object, b_type: type[Object]) -> Object:
    """
    Return an object converted to another type: directly, as a copy, or through a message.

    :raises TypeException: no registered functions convert one to the other. (tf2 returns a message
        of the wrong type if both are messages.)
    """
    straight = _converters.get((type(a), b_type))
    if straight is not None:
        return straight(a)
    if type(a) is b_type:
        return deepcopy(a)
    registration = ConvertRegistration()
    return registration.get_from_msg(b_type)(registration.get_to_msg(type(a))(a))


def Stamped(obj: Any, stamp: TimeLike, frame_id: str) -> Any:
    """
    Return an object with a header.

    An object that can have a header gets it and is returned itself, as in tf2. A message
    without one becomes its stamped form: a ``PointStamped`` holds a copy of the ``Point``.

    :param stamp: a ``Time`` of rclpy, or a message's.
    :raises TypeException: a message that has no form with a header.
    """
    header = Header(stamp=time_message(as_nanoseconds(stamp, Time)), frame_id=frame_id)
    if type(obj) in STAMPED_FORMS:
        cls, field = STAMPED_FORMS[type(obj)]
        return cls(header=header, **{field: deepcopy(obj)})
    try:
        obj.header = header
    except AttributeError:
        raise TypeException(f'A {type(obj).__name__} cannot have a header') from None
    return obj
