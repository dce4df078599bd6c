"""The labs over DDS: only these import rclpy and ``tf_tree_py.ros``."""
