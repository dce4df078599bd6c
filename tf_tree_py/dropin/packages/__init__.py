"""
Packages with tf2's names, which only list what they import from ``tf_tree_py``.

This folder itself is put on Python's path (see ``tf_tree_py.dropin``), so they are
imported by their own names. Do not import from ``tf_tree_py.dropin.packages``.
"""
