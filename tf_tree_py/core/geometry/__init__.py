"""
Rotations and poses: formulas on plain floats, and the same on arrays.

No frames, no time.
"""
