"""
What is wrong with a tree: watched as it arrives, judged by checks, told as findings.

What is told of a healthy tree is in ``telling``; how findings are shown, in ``tools``.
"""
