"""
A buffer that is asked from another process, by tf2's action.

The answers are the buffer's.
"""
