# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Threads that write and read one buffer, and what goes wrong in them."""

import sys
import threading

from programs import PATIENCE_S


class Crew:
    """Threads, which are switched a thousand times as often as usual; and what went wrong."""

    def __init__(self):
        self.errors = []
        self.done = threading.Event()
        self.writers, self.readers = [], []

    def write(self, function, *arguments):
        self.writers.append(threading.Thread(
            target=self._guard, args=(function, *arguments), daemon=True))

    def read(self, function, *arguments):
        """Run a function once, and again and again until the writers are done."""
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
        """Let all begin, and return when the writers are done; raise what one of them raised."""
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
