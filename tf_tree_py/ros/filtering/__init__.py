"""
Messages that are held back until their transform is there.

The transforms are the buffer's.
"""
