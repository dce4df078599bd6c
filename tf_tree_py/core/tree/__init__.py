"""
Which frames hang on which, the way between two, and what can be asked of that.

Nothing here waits.
"""
