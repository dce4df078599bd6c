"""The command ``scripts/arm``: a simulated arm picks a block that its camera sees."""

import os
import signal
import sys


def main() -> int:
    """Run the command; return its exit status."""
    try:
        # Imported here, because it takes a while: Ctrl-C during the import is a normal end too.
        from .command import run
        return run()
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one must not interrupt the end
        return 130
    except BrokenPipeError:  # as of `| head`; stdout is flushed once more at the end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == '__main__':
    sys.exit(main())
