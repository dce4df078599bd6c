"""
Waiting by a ROS clock, and without a thread of one's own.

It does not know what is waited for.
"""
