"""
Executables that a person runs to look at a tree, live or recorded.

What they find out is computed below them, in ``core``; executables that stay up are in
``nodes``.
"""
