"""
Transforms on their way in: bytes, samples, names, what is refused or odd.

Nothing is stored here.
"""
