"""
Between messages and plain numbers; messages taken from frame to frame.

No topics, no buffer.
"""
