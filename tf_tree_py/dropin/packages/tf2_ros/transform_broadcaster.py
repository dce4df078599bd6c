"""Names of tf2_ros.transform_broadcaster."""

from tf_tree_py.ros.broadcaster import TransformBroadcaster

__all__ = ['TransformBroadcaster']
