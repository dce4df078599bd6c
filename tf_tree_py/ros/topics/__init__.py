"""
What is heard and published on /tf and /tf_static, and by whom.

What is stored is in the buffer.
"""
