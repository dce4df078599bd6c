# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.static_transform_broadcaster."""

from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster

__all__ = ['StaticTransformBroadcaster', *star(__name__)]
