"""
What can be wrong with a tree: a function for each code, a file for each theme.

What they look at is measured in ``vitals``; ``doctor`` asks them all.
"""
