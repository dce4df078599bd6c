"""Real rclpy over real DDS, on this machine alone and on a domain of this process alone."""

from domains import isolate

isolate()
