"""
The threads and nodes of our own, which serve what must not wait for a user.

What they deliver is nothing to them.
"""
