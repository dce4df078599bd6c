"""Executables that stay up: the robot of five frames, who looks at it, and static transforms."""
