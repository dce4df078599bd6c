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

"""What takes long is told on stderr; what does not is not."""

import sys
import threading

from programs import PATIENCE_S
import pytest
from tf_tree_py.labs import progress as module
from tf_tree_py.labs.progress import progress


class Told:
    """A stream that tells when something was written."""

    def __init__(self, terminal=False):
        self.text = ''
        self.written = threading.Event()
        self._terminal = terminal

    def isatty(self):
        return self._terminal

    def write(self, text):
        self.text += text
        self.written.set()

    def flush(self):
        pass


def test_nothing_is_said_of_what_is_quick(capsys):
    with progress('a lab'):
        pass
    assert capsys.readouterr() == ('', '')


@pytest.mark.parametrize('terminal', [False, True])
def test_line_says_what_takes_long(terminal, monkeypatch):
    monkeypatch.setattr(module, 'PATIENCE_S', 0.01)
    monkeypatch.setattr(sys, 'stderr', told := Told(terminal))
    with progress('a lab'):
        assert told.written.wait(PATIENCE_S)
    assert 'a lab: 0 s so far, Ctrl-C ends it' in told.text
    # The line on a terminal is taken away again.
    assert told.text.endswith('\r\x1b[K' if terminal else 'ends it\n')


def test_thread_ends_with_what_it_tells_of():
    with pytest.raises(KeyboardInterrupt), progress('a lab'):
        raise KeyboardInterrupt
    assert not [thread for thread in threading.enumerate() if thread.name == 'progress']
