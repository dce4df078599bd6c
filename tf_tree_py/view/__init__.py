"""
The live page: a tree in the browser.

What a page shows is found out as plain data first (``shown``), and drawn by viser
(``page``). What is asked of the tree is ``core``'s.
"""
