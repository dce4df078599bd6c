# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bar on a terminal, and no output elsewhere."""

import os
import pty
import subprocess
import sys

from bags import RUN, write_ros2
from programs import PATIENCE_S
import pytest

PROGRAM = 'import sys; from tf_tree_py.bag import open_bag; print(open_bag(sys.argv[1]))'


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_ros2(tmp_path_factory.mktemp('bag') / 'run', RUN)


def run(bag, **options):
    return subprocess.run([sys.executable, '-c', PROGRAM, bag], stdout=subprocess.PIPE, text=True,
                          timeout=PATIENCE_S, check=True, **options)


def test_terminal_gets_a_bar(bag):
    terminal, end = pty.openpty()
    try:
        done = run(bag, stderr=end, env={**os.environ, 'TERM': 'xterm', 'COLUMNS': '80'})
        shown = os.read(terminal, 65_536).decode()
    finally:
        os.close(end)
        os.close(terminal)
    assert 'run' in shown and '100%' in shown
    assert done.stdout.startswith('<Recording: 6 frames')


def test_what_is_no_terminal_gets_nothing(bag):
    assert run(bag, stderr=subprocess.PIPE).stderr == ''
