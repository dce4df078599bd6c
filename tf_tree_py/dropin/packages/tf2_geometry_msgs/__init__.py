# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of tf2_geometry_msgs, backed by tf_tree_py."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401

from . import tf2_geometry_msgs

__all__ = [*tf2_geometry_msgs.__all__, 'tf2_geometry_msgs']
globals().update({name: getattr(tf2_geometry_msgs, name) for name in tf2_geometry_msgs.__all__})
