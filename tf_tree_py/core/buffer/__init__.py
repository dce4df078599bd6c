"""
The lock, the way in, and those who wait.

What is stored and answered is the business of the tree.
"""
