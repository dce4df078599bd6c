# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The interface that a buffer in this process and one in another share, as in tf2.

Wrong arguments in the place of a buffer or a node are refused at once with a clear error;
otherwise an AttributeError would follow later.
"""

from collections.abc import Callable
from functools import cache, cached_property
from types import ModuleType
from typing import Any, Literal, overload, TYPE_CHECKING

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from std_msgs.msg import Header
from tf_tree_py.beyond.freshness.ages import checked_max_age

from .answers import answered
from ..messages.convert import as_nanoseconds, as_span, DurationLike, SpanLike, TimeLike
from ..waiting.futures import AwaitableFuture, outcome

if TYPE_CHECKING:
    from ..messages.registry import TransformRegistration


def check_is_ours(buffer: object, ours: type, user: str) -> None:
    """
    Refuse a buffer of another library: tf2's has the same name and other methods.

    :param ours: the class ``Buffer`` of this package.
    :param user: the name of the class that takes it.
    :raises TypeError: another class, such as ``tf2_ros.Buffer``, or a node in its place.
    """
    if isinstance(buffer, ours):
        return
    cls = type(buffer)
    what_to_do = ('the buffer comes first, and then the node' if isinstance(buffer, Node)
                  else 'create it with `from tf_tree_py import Buffer`')
    raise TypeError(f'{user} takes a Buffer of tf_tree_py, and this is a '
                    f'{cls.__module__}.{cls.__qualname__}: {what_to_do}')


def check_places(call: str, *, buffer: object = None, node: object = None) -> None:
    """
    Refuse a node in the place of a buffer, and a buffer in the place of a node.

    :param call: the right call, for the error.
    :param buffer: the argument in the place of a buffer.
    :param node: the argument in the place of a node.
    :raises TypeError: they are swapped.
    """
    if isinstance(buffer, Node):
        raise TypeError(f'{call}: the buffer comes first, and here it is a '
                        f'{type(buffer).__name__}')
    if hasattr(node, 'lookup_transform') and not isinstance(node, Node):
        raise TypeError(f'{call}: the node is a {type(node).__name__}')


# --- the interface

# The default timeout; a buffer may recognise this object.
NO_TIME = Duration()


@cache
def _registry() -> ModuleType:
    """Import the registry when it is first needed, because it imports many messages."""
    from ..messages import registry
    return registry


class BufferInterface:
    """
    Transforms messages and other objects with the lookup of a subclass.

    The types that can be transformed are listed in ``do_transform``; ``TransformRegistration``
    adds a user's own type.
    """

    @cached_property
    def registration(self) -> 'TransformRegistration':
        """Return the registry of the types that can be transformed, one for all buffers."""
        return _registry().TransformRegistration()

    def transform(self, object_stamped: object, target_frame: str, timeout: DurationLike = NO_TIME,
                  new_type: type | None = None, *, header: Header | None = None,
                  max_age: SpanLike = None) -> Any:
        """
        Return an object in another frame, at its own stamp.

        :param object_stamped: has a ``header``, unless one is given.
        :param timeout: an rclpy ``Duration`` to wait for the transform.
        :param new_type: convert the result to this type.
        :param header: supplies the frame and the stamp of the object; a message without a header
            is returned without one.
        :param max_age: an rclpy ``Duration``: how old the latest transform may be, for an object
            whose stamp is zero.
        :raises TypeException: no function is registered for objects of this type.
        :raises TransformException: as ``lookup_transform``.
        """
        transformer = self.registration.get(type(object_stamped))
        header = _header_of(object_stamped) if header is None else header
        result = transformer(object_stamped, self.lookup_transform(
            target_frame, header.frame_id, header.stamp, timeout, **_given(max_age)))
        return result if new_type is None else _registry().convert(result, new_type)

    def transform_full(self, object_stamped: object, target_frame: str, target_time: TimeLike,
                       fixed_frame: str, timeout: DurationLike = NO_TIME,
                       new_type: type | None = None, *, header: Header | None = None) -> Any:
        """
        Return an object in another frame at another time, through a frame that does not move.

        :param target_time: an rclpy ``Time``, or a message's.
        :param fixed_frame: the frame in which the object does not move between the two times.

        The other parameters and errors are those of ``transform``.
        """
        transformer = self.registration.get(type(object_stamped))
        header = _header_of(object_stamped) if header is None else header
        result = transformer(object_stamped, self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout))
        return result if new_type is None else _registry().convert(result, new_type)

    def lookup_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                         timeout: DurationLike = NO_TIME, *,
                         max_age: SpanLike = None) -> TransformStamped:
        """Return the transform from source to target; a subclass implements it."""
        raise _registry().NotImplementedException()

    def lookup_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                              source_time: TimeLike, fixed_frame: str,
                              timeout: DurationLike = NO_TIME) -> TransformStamped:
        """Return the transform between two times; a subclass implements it."""
        raise _registry().NotImplementedException()

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: TimeLike,
                                 timeout: DurationLike | None = None, *,
                                 max_age: SpanLike = None) -> AwaitableFuture:
        """Return a future of the transform; a subclass implements it."""
        raise _registry().NotImplementedException()

    def wait_for_transform_full_async(
            self, target_frame: str, target_time: TimeLike, source_frame: str,
            source_time: TimeLike, fixed_frame: str,
            timeout: DurationLike | None = None) -> AwaitableFuture:
        """Return a future of the transform between two times; a subclass implements it."""
        raise _registry().NotImplementedException()

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: TimeLike,
                                     timeout: DurationLike | None = None, *,
                                     max_age: SpanLike = None) -> TransformStamped:
        """Return the transform as soon as it is available."""
        return await outcome(self.wait_for_transform_async(
            target_frame, source_frame, time, timeout, **_given(max_age)))

    async def lookup_transform_full_async(
            self, target_frame: str, target_time: TimeLike, source_frame: str,
            source_time: TimeLike, fixed_frame: str,
            timeout: DurationLike | None = None) -> TransformStamped:
        """Return the transform between two times as soon as it is available."""
        return await outcome(self.wait_for_transform_full_async(
            target_frame, target_time, source_frame, source_time, fixed_frame, timeout))

    @overload
    def can_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                      timeout: DurationLike = NO_TIME,
                      return_debug_tuple: Literal[False] = False, *,
                      max_age: SpanLike = None) -> bool: ...

    @overload
    def can_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                      timeout: DurationLike = NO_TIME, *, return_debug_tuple: Literal[True],
                      max_age: SpanLike = None) -> tuple[bool, str]: ...

    @overload
    def can_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                      timeout: DurationLike, return_debug_tuple: bool, *,
                      max_age: SpanLike = None) -> bool | tuple[bool, str]: ...

    def can_transform(self, target_frame: str, source_frame: str, time: TimeLike,
                      timeout: DurationLike = NO_TIME, return_debug_tuple: bool = False, *,
                      max_age: SpanLike = None) -> bool | tuple[bool, str]:
        """
        Return whether ``lookup_transform`` would succeed.

        :param return_debug_tuple: return (answer, reason) instead.
        :param max_age: see ``lookup_transform``.
        """
        _check_times(timeout, time)
        _check_limit(max_age)
        return _answer(return_debug_tuple, lambda: self.lookup_transform(
            target_frame, source_frame, time, timeout, **_given(max_age)))

    @overload
    def can_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                           source_time: TimeLike, fixed_frame: str,
                           timeout: DurationLike = NO_TIME,
                           return_debug_tuple: Literal[False] = False) -> bool: ...

    @overload
    def can_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                           source_time: TimeLike, fixed_frame: str,
                           timeout: DurationLike = NO_TIME, *,
                           return_debug_tuple: Literal[True]) -> tuple[bool, str]: ...

    @overload
    def can_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                           source_time: TimeLike, fixed_frame: str, timeout: DurationLike,
                           return_debug_tuple: bool) -> bool | tuple[bool, str]: ...

    def can_transform_full(self, target_frame: str, target_time: TimeLike, source_frame: str,
                           source_time: TimeLike, fixed_frame: str,
                           timeout: DurationLike = NO_TIME,
                           return_debug_tuple: bool = False) -> bool | tuple[bool, str]:
        """
        Return whether ``lookup_transform_full`` would succeed.

        :param return_debug_tuple: return (answer, reason) instead.
        """
        _check_times(timeout, target_time, source_time)
        return _answer(return_debug_tuple, lambda: self.lookup_transform_full(
            target_frame, target_time, source_frame, source_time, fixed_frame, timeout))


def _given(max_age: SpanLike) -> dict[str, Any]:
    """Return the limit as an argument, if there is one: a user's class has tf2's parameters."""
    return {} if max_age is None else {'max_age': max_age}


def _check_times(timeout: object, *times: object) -> None:
    """Refuse arguments that are not times: the answer False would hide a mistake in the caller."""
    for time in times:
        as_nanoseconds(time, Time)
    as_nanoseconds(timeout)


def _check_limit(max_age: SpanLike) -> None:
    given = as_span(max_age, 'max_age')
    if given is not None:
        checked_max_age(given)


def _answer(with_reason: bool, lookup: Callable[[], object]) -> bool | tuple[bool, str]:
    # The text of an error costs more than a lookup.
    answer = answered(lookup, str if with_reason else lambda _: '')
    return answer if with_reason else answer[0]


def _header_of(object_stamped: object) -> Header:
    header = getattr(object_stamped, 'header', None)
    if header is None:
        name = type(object_stamped).__name__
        raise _registry().TypeException(
            f'A {name} has no header with its frame and its stamp: pass header=..., or '
            'Stamped(object, stamp, frame_id)')
    return header
