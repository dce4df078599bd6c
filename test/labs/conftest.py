"""What needs ROS runs on this machine alone, on a domain of this process alone."""

from importlib.util import find_spec

from domains import isolate

# The labs themselves need no ROS, and so most of their tests.
collect_ignore = [] if find_spec('rclpy') else ['test_audit_ros.py', 'test_live.py']

# Before rclpy.init, here and in the processes that tests start; a lab's session has its own.
isolate()
