"""
Trajectories out of bags: at which stamps, and into what kind of file.

Their poses are ``core``'s, and bags are read by ``bag``.
"""
