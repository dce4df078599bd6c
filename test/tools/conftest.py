# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The ROS context of the tools' tests that are live; the others need no ROS."""

import pytest


@pytest.fixture(scope='module')
def context():
    import rclpy
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    yield context
    context.try_shutdown()
