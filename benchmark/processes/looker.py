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

"""
A tool of this package that looks at /tf: ``python -m benchmark.processes.looker TOOL``.

It runs in a process and on a terminal of its own, as it does for a person; this one only
tells what CPU it has had.
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
    """Return the seconds of CPU that a process has had; see proc_pid_stat(5)."""
    with open(f'/proc/{pid}/stat') as file:
        fields = file.read().rpartition(') ')[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICKS


def main() -> None:
    ours, theirs = pty.openpty()
    tool = subprocess.Popen([sys.executable, '-m', f'tf_tree_py.tools.{sys.argv[1]}', '--seconds',
                             _FOREVER_S], stdin=theirs, stdout=theirs, stderr=theirs)
    threading.Thread(target=_drain, args=(ours,), daemon=True).start()
    # What it takes in, it does not tell.
    serve({'usage': lambda transforms: {'cpu_s': cpu_s(tool.pid), 'received': None}})
    tool.terminate()
    tool.wait()


def _drain(terminal: int) -> None:
    while os.read(terminal, 1 << 16):
        pass


if __name__ == '__main__':
    main()
