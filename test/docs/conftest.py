"""What runs here runs on this machine alone, on a domain of this process alone."""

from domains import isolate

isolate()
