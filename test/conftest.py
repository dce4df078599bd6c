"""What holds for the tests of all folders."""

import signal


def pytest_configure():
    """
    Let processes that tests start hear Ctrl-C, also where this one is to ignore it.

    A shell makes what it runs in the background ignore SIGINT, and children inherit that.
    They do not inherit a handler, so here is one that ignores it as well.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: None)
