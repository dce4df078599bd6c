# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Ctrl-C once more, while Python exits: ``timeout -s INT`` sends two signals.

Python would stop a thread that is left inside rclpy, which aborts the process (docs/ending.md).
"""

import sys

from programs import completed
import pytest

PROGRAM = """
import atexit, os, signal, sys, threading

# What is registered first is called last.
atexit.register(lambda: print(*(thread.name.split('_')[1] for thread in threading.enumerate()
                                if thread.name.endswith('receiver'))))
import rclpy
from tf_tree_py import Buffer, TransformListener

def interrupt(frame, event, _):
    if event == 'call' and frame.f_code.co_name == sys.argv[1]:
        sys.setprofile(None)
        print('interrupted')
        os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
rclpy.init(args=[])
# Without a node of the program, nothing stops them earlier.
listeners = [TransformListener(Buffer()) for _ in range(2)]
atexit.register(sys.setprofile, interrupt)
"""


@pytest.mark.parametrize('function', ['_close_all', 'close', 'stop'])
def test_ctrl_c_while_python_exits_leaves_no_thread(function):
    done = completed(sys.executable, '-c', PROGRAM, function)
    assert done.stdout == 'interrupted\n\n', done.stderr
    assert done.returncode == 0, done.stderr
