"""Names of tf2_sensor_msgs, backed by tf_tree_py."""

from . import tf2_sensor_msgs

__all__ = tf2_sensor_msgs.__all__
globals().update({name: getattr(tf2_sensor_msgs, name) for name in __all__})
