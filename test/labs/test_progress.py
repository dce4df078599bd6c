# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Slow steps are reported on stderr; quick ones are not."""

import sys
import threading

from programs import PATIENCE_S
import pytest
from tf_tree_py.labs import tf_lab as module
from tf_tree_py.labs.tf_lab import progress


class Told:
    """A stream that sets an event when something is written."""

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
    # The line on a terminal is erased at the end.
    assert told.text.endswith('\r\x1b[K' if terminal else 'ends it\n')


def test_thread_ends_with_what_it_tells_of():
    with pytest.raises(KeyboardInterrupt), progress('a lab'):
        raise KeyboardInterrupt
    assert not [thread for thread in threading.enumerate() if thread.name == 'progress']
