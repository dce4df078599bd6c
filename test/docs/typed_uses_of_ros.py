# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The documented types of what needs ROS, for type checkers."""

from typing import assert_type

from rclpy.duration import Duration
from rclpy.time import Time
from tf_tree_py import Buffer, convert


def questions(buffer: Buffer, time: Time, timeout: Duration, debug: bool) -> None:
    """Without ``return_debug_tuple`` the answer is a bool; with it, a pair."""
    assert_type(buffer.can_transform('map', 'base', time), bool)
    assert_type(buffer.can_transform('map', 'base', time, return_debug_tuple=True),
                tuple[bool, str])
    assert_type(buffer.can_transform('map', 'base', time, timeout, debug), bool | tuple[bool, str])
    assert_type(buffer.can_transform_full('map', time, 'base', time, 'odom'), bool)
    assert_type(buffer.can_transform_full('map', time, 'base', time, 'odom', timeout,
                                          return_debug_tuple=True), tuple[bool, str])


class Cloud:
    """A user's own type."""


def conversions(message: object) -> None:
    """Assert that a conversion returns the type that it is asked for."""
    assert_type(convert(message, Cloud), Cloud)
