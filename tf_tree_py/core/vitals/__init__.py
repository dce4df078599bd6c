"""
What is measured of a tree as it arrives: rates, delays, steps, of each edge, for ever.

Whether that is right is not judged here: ``checks`` do.
"""
