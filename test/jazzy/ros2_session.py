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
A program: ``ros2`` commands one after the other, in one process.

A line of standard input is a JSON list of words; the line that answers it has the status and
what was written to both streams. A command does what it does by itself; but most of a
second of that is to begin Python, and to import rclpy.
"""

from contextlib import contextmanager
import json
import os
import sys
import tempfile

from ros2cli import cli


def status_of(words):
    """Run a command; return the status with which its process would end."""
    sys.argv = ['ros2', *words]
    try:
        told = cli.main()
    except SystemExit as leaving:
        told = leaving.code
    if isinstance(told, str):
        print(told, file=sys.stderr)
        return 1
    return int(told or 0)


@contextmanager
def captured(number):
    """Turn what goes to a file descriptor, also from C, into a file."""
    kept = os.dup(number)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), number)
        try:
            yield file
        finally:
            os.dup2(kept, number)
            os.close(kept)


def text_of(file):
    """Return all that was written to a file."""
    file.seek(0)
    return file.read().decode()


def run(words):
    """Return a command's status, and what it wrote to both streams."""
    with captured(1) as out, captured(2) as err:
        status = status_of(words)
        sys.stdout.flush()
        sys.stderr.flush()
        return status, text_of(out), text_of(err)


def main():
    questions = os.fdopen(os.dup(0))
    # What a command starts must not read them.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for line in questions:
        print(json.dumps(run(json.loads(line))), flush=True)


if __name__ == '__main__':
    main()
