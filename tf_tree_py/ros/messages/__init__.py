"""
Conversions between messages and numbers, and messages transformed to another frame.

No topics, no buffer.
"""
