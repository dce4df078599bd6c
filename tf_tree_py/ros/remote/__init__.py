"""
Lookups in the buffer of another process: tf2's action, its server and its client.

How a lookup is answered is not here: the server asks its buffer.
"""
