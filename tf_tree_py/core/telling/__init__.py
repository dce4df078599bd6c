"""
What a buffer holds and how it is used, as data and as text.

Nothing here changes it.
"""
