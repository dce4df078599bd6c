# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_ros.transform_listener."""

from tf_tree_py.dropin.buffer import Buffer
from tf_tree_py.dropin.imported_names import __getattr__, star  # noqa: F401
from tf_tree_py.dropin.listener import TransformListener
from tf_tree_py.ros.topics.qos import (
    TF_STATIC_TOPIC as DEFAULT_STATIC_TF_TOPIC,
    TF_TOPIC as DEFAULT_TF_TOPIC,
)

__all__ = ['Buffer', 'DEFAULT_STATIC_TF_TOPIC', 'DEFAULT_TF_TOPIC', 'TransformListener',
           *star(__name__)]
