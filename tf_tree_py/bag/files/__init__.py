"""
What was recorded, message by message, from files of any kind, whole or not.

Not here: what the messages say.
"""
