# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Record which lines of a package run, in a process and in all those that it starts.

``mutate.py`` puts a copy of this file on the path as ``sitecustomize.py``, which every Python
imports first. Each line of a file below ``$RUN_LINES_OF`` is written once, at once, to
``$RUN_LINES``, because a test may kill its process.
"""

from contextlib import suppress
import os
import sys

if folder := os.environ.get('RUN_LINES_OF'):
    output = os.open(os.environ['RUN_LINES'], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    monitoring = sys.monitoring
    # hypothesis also lets lines that were turned off return.
    recorded = set()

    def record(code, line):
        if code.co_filename.startswith(folder) and (code.co_filename, line) not in recorded:
            recorded.add((code.co_filename, line))
            # A test may limit the size of files, or close all of them.
            with suppress(OSError):
                os.write(output, f'{code.co_filename[len(folder) + 1:]}:{line}\n'.encode())
        return monitoring.DISABLE

    monitoring.use_tool_id(monitoring.COVERAGE_ID, 'run_lines')
    monitoring.register_callback(monitoring.COVERAGE_ID, monitoring.events.LINE, record)
    monitoring.set_events(monitoring.COVERAGE_ID, monitoring.events.LINE)
