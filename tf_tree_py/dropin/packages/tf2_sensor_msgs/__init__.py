# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_sensor_msgs, backed by tf_tree_py."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401

from . import tf2_sensor_msgs

# tf2 has an ``__all__`` here.
__all__ = ['do_transform_cloud', 'transform_points']
globals().update({name: getattr(tf2_sensor_msgs, name) for name in tf2_sensor_msgs.__all__})
