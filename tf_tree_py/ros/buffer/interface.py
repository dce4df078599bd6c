# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What a buffer in this process and one in another have in common, as in tf2."""

from collections.abc import Callable
from functools import cache, cached_property
from importlib import import_module
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from std_msgs.msg import Header
from tf_tree_py.core.errors import TransformException

from ..messages.convert import as_nanoseconds
from ..waiting.futures import outcome

# The timeout of whoever gives none; a buffer may recognise it.
NO_TIME = Duration()


@cache
def _registry() -> Any:
    """Import what can be transformed when it is first needed: that is many messages."""
    return import_module('tf_tree_py.ros.messages.registry')


class BufferInterface:
    """
    Transforms messages and other objects with whatever lookup a subclass has.

    What can be transformed stands in ``stamped``; a type of one's own is added with
    ``TransformRegistration``.
    """

    @cached_property
    def registration(self) -> Any:
        """Return the registry of what can be transformed, one for all buffers."""
        return _registry().TransformRegistration()

    def transform(self, object_stamped: Any, target_frame: str, timeout: Any = NO_TIME,
                  new_type: type | None = None, *, header: Header | None = None) -> Any:
        """
        Return an object in another frame, at its own stamp.

        :param object_stamped: has a ``header``, unless one is given.
        :param timeout: an rclpy ``Duration`` to wait for the transform.
        :param new_type: convert the result to this type.
        :param header: whose frame and stamp to take the object for; a message without
            header comes back without.
        :raises TypeException: nobody said how to transform objects of this type.
        :raises TransformException: as ``lookup_transform``.
        """
        transformer = self.registration.get(type(object_stamped))
        header = _header_of(object_stamped) if header is None else header
        result = transformer(object_stamped, self.lookup_transform(
            target_frame, header.frame_id, header.stamp, timeout))
        return result if new_type is None else _registry().convert(result, new_type)

    def transform_full(self, object_stamped: Any, target_frame: str, target_time: Any,
                       fixed_frame: str, timeout: Any = NO_TIME,
                       new_type: type | None = None, *, header: Header | None = None) -> Any:
        """
        Return an object in another frame at another time, through a frame that stays put.

        :param target_time: an rclpy ``Time``, or a message's.
        :param fixed_frame: in which the object does not move between the two times.

        The other parameters and errors are those of ``transform``.
        """
        transformer = self.registration.get(type(object_stamped))
        header = _header_of(object_stamped) if header is None else header
        result = transformer(object_stamped, self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout))
        return result if new_type is None else _registry().convert(result, new_type)

    def lookup_transform(self, target_frame: str, source_frame: str, time: Any,
                         timeout: Any = NO_TIME) -> TransformStamped:
        """Return the transform from source to target; a subclass says how."""
        raise _registry().NotImplementedException()

    def lookup_transform_full(self, target_frame: str, target_time: Any, source_frame: str,
                              source_time: Any, fixed_frame: str,
                              timeout: Any = NO_TIME) -> TransformStamped:
        """Return the transform between two times; a subclass says how."""
        raise _registry().NotImplementedException()

    def wait_for_transform_async(self, target_frame: str, source_frame: str, time: Any,
                                 timeout: Any = None) -> Any:
        """Return a future of the transform; a subclass says how."""
        raise _registry().NotImplementedException()

    def wait_for_transform_full_async(
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str, timeout: Any = None) -> Any:
        """Return a future of the transform between two times; a subclass says how."""
        raise _registry().NotImplementedException()

    async def lookup_transform_async(self, target_frame: str, source_frame: str, time: Any,
                                     timeout: Any = None) -> TransformStamped:
        """Return the transform as soon as it is there."""
        return await outcome(self.wait_for_transform_async(
            target_frame, source_frame, time, timeout))

    async def lookup_transform_full_async(
            self, target_frame: str, target_time: Any, source_frame: str, source_time: Any,
            fixed_frame: str, timeout: Any = None) -> TransformStamped:
        """Return the transform between two times as soon as it is there."""
        return await outcome(self.wait_for_transform_full_async(
            target_frame, target_time, source_frame, source_time, fixed_frame, timeout))

    def can_transform(self, target_frame: str, source_frame: str, time: Any,
                      timeout: Any = NO_TIME,
                      return_debug_tuple: bool = False) -> bool | tuple[bool, str]:
        """
        Return whether ``lookup_transform`` would succeed.

        :param return_debug_tuple: return (answer, why not) instead.
        """
        _check_times(time, timeout)
        return _answered(return_debug_tuple, lambda: self.lookup_transform(
            target_frame, source_frame, time, timeout))

    def can_transform_full(self, target_frame: str, target_time: Any, source_frame: str,
                           source_time: Any, fixed_frame: str, timeout: Any = NO_TIME,
                           return_debug_tuple: bool = False) -> bool | tuple[bool, str]:
        """
        Return whether ``lookup_transform_full`` would succeed.

        :param return_debug_tuple: return (answer, why not) instead.
        """
        _check_times(target_time, source_time, timeout)
        return _answered(return_debug_tuple, lambda: self.lookup_transform_full(
            target_frame, target_time, source_frame, source_time, fixed_frame, timeout))


def _check_times(*times: Any) -> None:
    """Refuse what is no time: answering False to it would hide a mistake in the program."""
    for time in times:
        as_nanoseconds(time)


def _answered(tell_why: bool, lookup: Callable[[], object]) -> bool | tuple[bool, str]:
    try:
        lookup()
    except TransformException as error:
        return (False, str(error)) if tell_why else False
    return (True, '') if tell_why else True


def _header_of(object_stamped: Any) -> Header:
    header = getattr(object_stamped, 'header', None)
    if header is None:
        name = type(object_stamped).__name__
        raise _registry().TypeException(
            f'A {name} has no header to say in which frame and when it is: pass header=..., or '
            'Stamped(object, stamp, frame_id)')
    return header
