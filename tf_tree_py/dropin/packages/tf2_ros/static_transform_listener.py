# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.static_transform_listener."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401
from tf_tree_py.dropin.listener import StaticTransformListener
from tf_tree_py.ros.topics.qos import TF_STATIC_TOPIC as DEFAULT_STATIC_TF_TOPIC

__all__ = ['DEFAULT_STATIC_TF_TOPIC', 'StaticTransformListener']
