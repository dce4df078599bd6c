"""
The transform tree on ROS 2: needs rclpy, geometry_msgs and tf2_msgs.

What users need of it has its name in ``tf_tree_py``, and is loaded on first use; so
nothing is imported here, for each name costs the time of all the messages it knows.
"""
