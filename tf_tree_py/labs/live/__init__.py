"""The labs over DDS: what only these import is rclpy and ``tf_tree_py.ros``."""
