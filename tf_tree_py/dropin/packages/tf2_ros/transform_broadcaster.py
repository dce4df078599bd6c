# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.transform_broadcaster."""

from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.ros.topics.broadcaster import TransformBroadcaster

__all__ = ['TransformBroadcaster', *star(__name__)]
