"""Names of tf2_ros.static_transform_broadcaster."""

from tf_tree_py.dropin.imported_names import __getattr__  # noqa: F401
from tf_tree_py.ros.topics.broadcaster import StaticTransformBroadcaster

__all__ = ['StaticTransformBroadcaster']
