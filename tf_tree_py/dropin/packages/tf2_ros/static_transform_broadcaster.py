"""Names of tf2_ros.static_transform_broadcaster."""

from tf_tree_py.ros.broadcaster import StaticTransformBroadcaster

__all__ = ['StaticTransformBroadcaster']
