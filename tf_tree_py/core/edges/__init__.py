"""
What is known of one edge over time.

Which edges there are is the business of the tree.
"""
