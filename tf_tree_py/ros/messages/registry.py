"""
Objects of one's own that can be transformed and converted, as tf2 registers them.

The names and what they do are tf2's. The messages of ``do_transform`` need no
registration; a function that is registered for one of their types is used instead.
"""

from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any

from geometry_msgs.msg import (
    Accel,
    AccelStamped,
    AccelWithCovariance,
    AccelWithCovarianceStamped,
    Point,
    PointStamped,
    Polygon,
    PolygonInstance,
    PolygonInstanceStamped,
    PolygonStamped,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    QuaternionStamped,
    Transform,
    TransformStamped,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)
from std_msgs.msg import Header
from tf_tree_py.core.errors import join, JoinableException

from .convert import as_nanoseconds, time_message
from .do_transform import Transformer, TRANSFORMERS

Converter = Callable[[Any], Any]

# tf2 keeps one registry for all, and so do these.
_transformers: dict[Any, Transformer] = {}
_from_msg: dict[Any, Converter] = {}
_to_msg: dict[Any, Converter] = {}
_converters: dict[tuple[Any, Any], Converter] = {}

STAMPED_FORMS: Mapping[type, tuple[type, str]] = {
    Point: (PointStamped, 'point'),
    Vector3: (Vector3Stamped, 'vector'),
    Quaternion: (QuaternionStamped, 'quaternion'),
    Pose: (PoseStamped, 'pose'),
    PoseWithCovariance: (PoseWithCovarianceStamped, 'pose'),
    Transform: (TransformStamped, 'transform'),
    Polygon: (PolygonStamped, 'polygon'),
    PolygonInstance: (PolygonInstanceStamped, 'polygon'),
    Wrench: (WrenchStamped, 'wrench'),
    Twist: (TwistStamped, 'twist'),
    TwistWithCovariance: (TwistWithCovarianceStamped, 'twist'),
    Accel: (AccelStamped, 'accel'),
    AccelWithCovariance: (AccelWithCovarianceStamped, 'accel'),
}
"""The message with a header that holds one without, and the field it is in."""


class TypeException(JoinableException):
    """An object of a type that nobody has said how to transform or convert."""

    def __init__(self, errstr: str) -> None:
        _init(self, errstr)


class NotImplementedException(JoinableException):
    """A buffer interface that does not implement what was asked of it."""

    def __init__(self) -> None:
        _init(self, 'CanTransform or LookupTransform not implemented')


def _init(error: Any, errstr: str) -> None:
    join('tf2_ros', (TypeException, NotImplementedException))
    # Not super(): that may be tf2's class by now, which takes something else.
    Exception.__init__(error, errstr)
    error.errstr = errstr


class TransformRegistration:
    """Which function transforms objects of which type; one registry for all instances."""

    def print_me(self) -> None:
        """Print the registry."""
        print({**TRANSFORMERS, **_transformers})

    def add(self, key: type, callback: Transformer) -> None:
        """
        Say how objects of a type are transformed.

        :param callback: takes (object, ``TransformStamped``) and returns a new object.
        """
        _transformers[key] = callback

    def get(self, key: type) -> Transformer:
        """
        Return how objects of a type are transformed.

        :raises TypeException: nobody said so.
        """
        transformer = _transformers.get(key) or TRANSFORMERS.get(key)
        if transformer is None:
            ready = ', '.join(kind.__name__ for kind in TRANSFORMERS)
            raise TypeException(
                f'Type {key} is not loaded or supported: say how it is transformed with '
                'TransformRegistration().add(type, function), where the function takes an object '
                f'and a TransformStamped. Ready without that: {ready}')
        return transformer


class ConvertRegistration:
    """Which function converts from one type to another; one registry for all instances."""

    def add_from_msg(self, key: type, callback: Converter) -> None:
        """Say how an object of a type is made of a message."""
        _from_msg[key] = callback

    def add_to_msg(self, key: type, callback: Converter) -> None:
        """Say which message an object of a type becomes."""
        _to_msg[key] = callback

    def add_convert(self, key: tuple[type, type], callback: Converter) -> None:
        """Say how an object of the first type becomes one of the second, straight."""
        _converters[key] = callback

    def get_from_msg(self, key: type) -> Converter:
        """
        Return how an object of a type is made of a message.

        :raises TypeException: nobody said so.
        """
        if key in TRANSFORMERS:
            return _from_msg.get(key, lambda message: _checked(message, key))
        return _found(_from_msg, key, 'add_from_msg')

    def get_to_msg(self, key: type) -> Converter:
        """
        Return which message an object of a type becomes.

        :raises TypeException: nobody said so.
        """
        if key in TRANSFORMERS:
            return _to_msg.get(key, _itself)
        return _found(_to_msg, key, 'add_to_msg')

    def get_convert(self, key: tuple[type, type]) -> Converter:
        """
        Return how an object of the first type becomes one of the second, straight.

        :raises TypeException: nobody said so.
        """
        if key not in _converters:
            raise TypeException(f'Type {key} is not loaded or supported')
        return _converters[key]


def _found(registry: dict[Any, Converter], key: type, fix: str) -> Converter:
    if key not in registry:
        raise TypeException(f'Type {key} is not loaded or supported: say how it is converted '
                            f'with ConvertRegistration().{fix}(type, function)')
    return registry[key]


def _itself(message: Any) -> Any:
    return message


def _checked(message: Any, kind: type) -> Any:
    if not isinstance(message, kind):
        raise TypeException(
            f'A {type(message).__name__} does not become a {kind.__name__}: say how with '
            'ConvertRegistration().add_convert((type, type), function)')
    return message


def convert(a: Any, b_type: type) -> Any:
    """
    Return an object as another type: straight, as a copy, or by way of a message.

    :raises TypeException: there is no way from one to the other. (tf2 returns a message
        of the wrong type where both are messages.)
    """
    straight = _converters.get((type(a), b_type))
    if straight is not None:
        return straight(a)
    if type(a) is b_type:
        return deepcopy(a)
    registration = ConvertRegistration()
    return registration.get_from_msg(b_type)(registration.get_to_msg(type(a))(a))


def Stamped(obj: Any, stamp: Any, frame_id: str) -> Any:
    """
    Return an object with a header.

    What can bear one gets it and is returned itself, as in tf2. A message without
    header becomes one with: a ``Point`` a ``PointStamped``, which holds a copy.

    :param stamp: a ``Time`` of rclpy, or a message's.
    :raises TypeException: a message that has no form with a header.
    """
    header = Header(stamp=time_message(as_nanoseconds(stamp)), frame_id=frame_id)
    if type(obj) in STAMPED_FORMS:
        kind, field = STAMPED_FORMS[type(obj)]
        return kind(header=header, **{field: deepcopy(obj)})
    try:
        obj.header = header
    except AttributeError:
        raise TypeException(f'A {type(obj).__name__} cannot bear a header') from None
    return obj
