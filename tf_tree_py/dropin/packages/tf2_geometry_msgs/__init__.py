"""Names of tf2_geometry_msgs, backed by tf_tree_py."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401

from . import tf2_geometry_msgs

__all__ = tf2_geometry_msgs.__all__
globals().update({name: getattr(tf2_geometry_msgs, name) for name in __all__})
