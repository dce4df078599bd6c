"""
Jazzy's ``tf2_msgs``, built where there is none: beside the wheels of ROS 2 Jazzy, which lack it.

``python -m tf_tree_py.interfaces`` builds it into the environment that runs it. Where ROS 2 is
installed by its packages, so is tf2_msgs, and nothing here is needed. No ROS is imported.
"""
