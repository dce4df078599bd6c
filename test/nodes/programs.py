"""Executables as processes of their own, watched by what they print: nothing here sleeps."""

import signal
import subprocess
import sys
import threading
import time

# Two processes need up to four seconds to find each other (Fast DDS announces itself every
# three), and a busy machine more.
PATIENCE_S = 30.0


class Program:
    """A process, and all that it has printed so far, both streams in one."""

    def __init__(self, *command):
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True)
        self._lines = []
        self._printed = threading.Condition()
        self._ended = False
        self._reader = threading.Thread(target=self._read, name='output of a program')
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            with self._printed:
                self._lines.append(line)
                self._printed.notify_all()
        with self._printed:
            self._ended = True
            self._printed.notify_all()

    @property
    def output(self):
        with self._printed:
            return ''.join(self._lines)

    def wait_for(self, text, count=1):
        """Return as soon as so many lines have the text in them."""
        deadline = time.monotonic() + PATIENCE_S
        with self._printed:
            while sum(text in line for line in self._lines) < count:
                left = deadline - time.monotonic()
                assert not self._ended and left > 0.0, (
                    f'no {text!r} in the output:\n{"".join(self._lines)}')
                self._printed.wait(left)

    def interrupt(self, number=signal.SIGINT):
        self._process.send_signal(number)

    def interrupt_until_it_ends(self):
        while self._process.poll() is None:
            self.interrupt()

    def end(self):
        """Wait for the process to end, and return its exit status."""
        status = self._process.wait(PATIENCE_S)
        self._reader.join()
        return status

    def kill(self):
        self._process.kill()
        self.end()
        self._process.stdout.close()


def executable(name, *arguments):
    """Return the command line of one of this package's executables."""
    return (sys.executable, '-m', f'tf_tree_py.nodes.{name}', *arguments)
