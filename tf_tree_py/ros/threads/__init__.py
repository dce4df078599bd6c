"""
Threads and small nodes of this package's own, which a user's busy callback cannot delay.

They hand over what arrives and do not look into it.
"""
