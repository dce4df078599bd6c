"""
Checks of a watched tree, a file for each theme.

What they look at is measured beside this room; ``catalogue`` has them all in order.
"""
