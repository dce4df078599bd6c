"""
Messages become a tree: decoded together where they are alike, judged, and summed up.

Not here: where the messages come from, and what is asked of the tree.
"""
