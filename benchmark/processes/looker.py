# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A tool of this package that observes /tf: ``python -m benchmark.processes.looker TOOL``.

The tool runs in a child process with its own terminal, as for a user. This process only
reports the child's CPU time.
"""

import os
import pty
import subprocess
import sys
import threading

from ..worker import serve

_FOREVER_S = '100000'
_TICKS = os.sysconf('SC_CLK_TCK')


def cpu_s(pid: int) -> float:
    """Return the CPU seconds that a process has used; see proc_pid_stat(5)."""
    with open(f'/proc/{pid}/stat') as file:
        fields = file.read().rpartition(') ')[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def main() -> None:
    ours, theirs = pty.openpty()
    tool = subprocess.Popen([sys.executable, '-m', f'tf_tree_py.tools.{sys.argv[1]}', '--seconds',
                             _FOREVER_S], stdin=theirs, stdout=theirs, stderr=theirs)
    threading.Thread(target=_drain, args=(ours,), daemon=True).start()
    # The tool does not report how many messages it received.
    serve({'usage': lambda transforms: {'cpu_s': cpu_s(tool.pid), 'received': None}})
    tool.terminate()
    tool.wait()


def _drain(terminal: int) -> None:
    while os.read(terminal, 1 << 16):
        pass


if __name__ == '__main__':
    main()
