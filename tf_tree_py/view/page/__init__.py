"""
A page in the browser, drawn by viser: the scene, the controls, and who is connected.

What is to be drawn is found out in ``shown``.
"""
