"""
Waiting by a ROS clock, and without a thread of one's own.

What is waited for is nothing to it.
"""
