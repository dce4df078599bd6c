"""
Packages with tf2's names: lists of what is theirs, and no code.

They are found by a folder on Python's path (see ``tf_tree_py.dropin``), under their own
names; so this folder is no package to import from.
"""
