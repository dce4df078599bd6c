# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The documented types of what needs ROS, for type checkers."""

from collections.abc import Iterator
from typing import assert_type

import numpy as np
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf_tree_py import (
    Buffer,
    BufferClient,
    convert,
    Pose as PlainPose,
    PoseSample,
    StaleException,
    TransformListener,
    UNLIMITED,
)


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


class Docking(Node):
    """A node that refuses old transforms."""

    def __init__(self) -> None:
        super().__init__('docking')
        self.buffer = Buffer(node=self, max_age=Duration(seconds=0.5))
        self.client = BufferClient(self, 'tf2_buffer_server')

    def dock(self, limit: Duration) -> None:
        """Use limits of rclpy and of messages, and ``UNLIMITED``."""
        try:
            self.buffer.lookup_transform('map', 'base', Time(), max_age=limit)
        except StaleException as error:
            assert_type(error.age, int | None)
            assert_type([edge.authority for edge in error.ages], list[str])
        self.buffer.lookup_transform('map', 'base', Time(), limit, max_age=UNLIMITED)
        self.client.lookup_transform('map', 'base', Time(), max_age=limit.to_msg())
        assert_type(self.buffer.can_transform('map', 'base', Time(), max_age=limit), bool)
        newest = self.buffer.lookup_transform_newest('map', 'base', timeout=limit, max_age=limit)
        self.get_logger().info(f'{newest.transform}: {newest.stamps["base"]}')

    async def dock_later(self, limit: Duration) -> None:
        """Use them with futures."""
        await self.buffer.lookup_transform_async('map', 'base', Time(), max_age=limit)
        self.buffer.wait_for_transform_async('map', 'base', Time(), max_age=None)


def read_cloud(message: Cloud) -> Iterator[PoseSample]:
    """Yield the poses of a message of a user's own type."""
    yield PoseSample('map', 'cloud', Time(), PlainPose(x=1.0))
    yield PoseSample('map', 'other', 1_000_000_000, np.eye(4), np.eye(6))


def topics(listener: TransformListener) -> None:
    """Subscribe to types with and without a reader."""
    listener.subscribe(Cloud, 'clouds', lambda message: [], covariances=True, child='base')
    listener.subscribe(Cloud, 'clouds', read_cloud)
    listener.subscribe(Cloud, 'clouds', lambda message: None, static=True, qos=1)
