"""What each worker of our own loads first: Ctrl-C is for the process that started it."""

import signal


def dask_setup(worker: object) -> None:
    """Let this process end when it is told to, and not by a key; dask calls it by name."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
