"""
How fast tf_tree_py is, beside its peers, in one run: ``scripts/bench``.

Nothing here is a test: nothing asserts a speed. What every contestant answers is
compared before it is timed.
"""
