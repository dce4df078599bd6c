"""
The buffer of tf2: the core with messages, clocks and timeouts.

What fills it is in topics.
"""
