# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Executables in child processes, observed by their output: nothing here sleeps."""

from contextlib import suppress
import os
import signal
import subprocess
import sys
import threading
import time

# Only a fault takes this long. Two processes need up to four seconds to find each other (Fast DDS
# announces itself every three), and a process up to forty to start where ten share a processor.
PATIENCE_S = 180.0


class Program:
    """
    A process and its output so far, both streams in one.

    With its own terminal, signals also go to all its children, as with Ctrl-C.
    """

    def __init__(self, *command, env=None, own_terminal=False):
        self._own_terminal = own_terminal
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, start_new_session=own_terminal,
            # A process that crashes prints where.
            env={**(os.environ if env is None else env), 'PYTHONFAULTHANDLER': '1'})
        self._lines = []
        self._printed = threading.Condition()
        self._ended = False
        self._reader = threading.Thread(
            target=self._read, name='output of a program', daemon=True)
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
    def pid(self):
        return self._process.pid

    @property
    def output(self):
        with self._printed:
            return ''.join(self._lines)

    def wait_for(self, text, count=1):
        """Return as soon as this number of lines contain the text."""
        deadline = time.monotonic() + PATIENCE_S
        with self._printed:
            while sum(text in line for line in self._lines) < count:
                left = deadline - time.monotonic()
                assert not self._ended and left > 0.0, (
                    f'no {text!r} in the output:\n{"".join(self._lines)}')
                self._printed.wait(left)

    def interrupt(self, number=signal.SIGINT):
        if self._own_terminal:
            os.killpg(self._process.pid, number)
        else:
            self._process.send_signal(number)

    def interrupt_until_it_ends(self):
        while self._process.poll() is None:
            self.interrupt()

    def end(self):
        """Wait for the process to end; return its exit status."""
        status = self._process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        assert not self._reader.is_alive(), 'a child of the program still holds its output open'
        return status

    def kill(self):
        if self._own_terminal and self._process.poll() is None:
            # Its children may have terminals of their own; they end when it is interrupted.
            self.interrupt()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(PATIENCE_S)
        with suppress(ProcessLookupError):
            self.interrupt(signal.SIGKILL)
        self.end()
        self._process.stdout.close()


def completed(*command, timeout=PATIENCE_S, **options):
    """Run a program to its end; return its exit status and its output as text."""
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=timeout,
                          **options)


def executable(name, *arguments):
    """Return the command line of one of this package's executables."""
    return (sys.executable, '-m', f'tf_tree_py.nodes.{name}', *arguments)


def without(*packages):
    """Return the first lines of a program in which some packages seem not to be installed."""
    return f"""
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] in {packages}:
            raise ModuleNotFoundError(f'No module named {{name!r}}', name=name)

sys.meta_path.insert(0, Blocker())
"""
