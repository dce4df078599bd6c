# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Threads that write and read one buffer, and their exceptions."""

import sys
import threading

from programs import PATIENCE_S


class Crew:
    """Threads, switched a thousand times as often as usual, and their exceptions."""

    def __init__(self):
        self.errors = []
        self.done = threading.Event()
        self.writers, self.readers = [], []

    def write(self, function, *arguments):
        self.writers.append(threading.Thread(
            target=self._guard, args=(function, *arguments), daemon=True))

    def read(self, function, *arguments):
        """Run a function at least once, and repeatedly until the writers are done."""
        def again_and_again():
            function(*arguments)
            while not self.done.is_set():
                function(*arguments)

        self.readers.append(threading.Thread(
            target=self._guard, args=(again_and_again,), daemon=True))

    def _guard(self, function, *arguments):
        try:
            function(*arguments)
        except BaseException as error:
            self.errors.append(error)
            self.done.set()

    def run(self):
        """Start all threads, and return when the writers are done; raise a thread's exception."""
        before = sys.getswitchinterval()
        sys.setswitchinterval(5e-6)
        try:
            self._run()
        finally:
            sys.setswitchinterval(before)

    def _run(self):
        for thread in (*self.readers, *self.writers):
            thread.start()
        for thread in self.writers:
            thread.join(PATIENCE_S)
        self.done.set()
        for thread in self.readers:
            thread.join(PATIENCE_S)
        stuck = [thread for thread in (*self.writers, *self.readers) if thread.is_alive()]
        assert not stuck, 'a deadlock'
        if self.errors:
            raise self.errors[0]
