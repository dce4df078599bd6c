"""
What a page shows, as plain data: which moment, where every frame is, what is told of one.

Nothing here knows viser, or a browser.
"""
