# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Program: run ``ros2`` commands one after the other, in one process.

A line of standard input is a JSON list of words; the line that is printed for it has the status
and the output of both streams. A command runs as it does by itself, but without the start of
Python, the import of rclpy and the search for installed verbs, which take a second.
"""

from contextlib import contextmanager
from functools import cache
import importlib.metadata
import json
import os
import sys
import tempfile

from ros2cli import cli


def status_of(words):
    """Run a command; return the status with which its process would end."""
    sys.argv = ['ros2', *words]
    try:
        result = cli.main()
    except SystemExit as leaving:
        result = leaving.code
    if isinstance(result, str):
        print(result, file=sys.stderr)
        return 1
    return int(result or 0)


@contextmanager
def captured(number):
    """Redirect the output of a file descriptor, also from C, to a file."""
    kept = os.dup(number)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), number)
        try:
            yield file
        finally:
            os.dup2(kept, number)
            os.close(kept)


def text_of(file):
    """Return the whole content of a file."""
    file.seek(0)
    return file.read().decode()


def run(words):
    """Return a command's status, and its output of both streams."""
    with captured(1) as out, captured(2) as err:
        status = status_of(words)
        sys.stdout.flush()
        sys.stderr.flush()
        return status, text_of(out), text_of(err)


def main():
    # Each command reads the entry points of all installed packages several times.
    importlib.metadata.entry_points = cache(importlib.metadata.entry_points)
    questions = os.fdopen(os.dup(0))
    # The programs that a command starts must not read them.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for line in questions:
        print(json.dumps(run(json.loads(line))), flush=True)


if __name__ == '__main__':
    main()
