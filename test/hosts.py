# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Two separate hosts on one machine, and a link between them.

Each host is a network namespace. A pair of virtual ports connects only these two, so no traffic
leaves this machine. It needs root.
"""

from contextlib import closing, contextmanager, ExitStack
import os
import shutil
import subprocess
import sys
import textwrap

from conditions import until
from programs import PATIENCE_S
import pytest

LINK = 'link0'


def ip(*arguments):
    """Run the command; return its output."""
    return subprocess.run(['ip', *arguments], check=True, capture_output=True, text=True,
                          timeout=PATIENCE_S).stdout


class Host:
    """A network namespace, and a program that reads lines and prints one line for each."""

    def __init__(self, number):
        self.number, self.name = number, f'tf_{os.getpid()}_{number}'
        self.address = f'10.0.0.{number}'
        self._process = None
        ip('netns', 'add', self.name)

    def run(self, program, **environment):
        """Start a program; return when it has printed its first line."""
        self._process = subprocess.Popen(
            ['ip', 'netns', 'exec', self.name, sys.executable, '-c', textwrap.dedent(program)],
            text=True, env={**os.environ, **environment}, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE)
        assert self._process.stdout.readline()

    def tell(self, line):
        """Send a line to the program; return the line that it prints."""
        print(line, file=self._process.stdin, flush=True)
        return self._process.stdout.readline().strip()

    def raise_link(self):
        """Give the host's address to the port of the link, and set the port up."""
        ip('-n', self.name, 'address', 'add', f'{self.address}/24', 'dev', LINK)
        self.set_link('up')

    def set_link(self, state):
        """Set the link 'up' or 'down'."""
        ip('-n', self.name, 'link', 'set', LINK, state)

    def end(self):
        """End the program, if there is one."""
        process, self._process = self._process, None
        if process is not None:
            try:
                process.stdin.close()
                assert process.wait(PATIENCE_S) == 0
            finally:
                process.kill()
                process.stdout.close()

    def close(self):
        try:
            self.end()
        finally:
            ip('netns', 'delete', self.name)


@contextmanager
def two_apart():
    """Yield two unconnected hosts; skip the test where they cannot be created."""
    if shutil.which('ip') is None:
        pytest.skip('two hosts need the command ip (of iproute2), which is not installed')
    with ExitStack() as stack:
        try:
            made = [stack.enter_context(closing(Host(number))) for number in (1, 2)]
            for host in made:
                ip('-n', host.name, 'link', 'set', 'lo', 'up')
        except subprocess.CalledProcessError as error:
            pytest.skip(f'two hosts need the right to make network namespaces: {error.stderr}')
        yield made


@contextmanager
def two_hosts():
    """Yield two hosts connected by a link; skip the test where they cannot be created."""
    with two_apart() as made:
        ip('-n', made[0].name, 'link', 'add', LINK, 'type', 'veth',
           'peer', LINK, 'netns', made[1].name)
        for host in made:
            host.raise_link()
        for host in made:
            _await_link(host)
        yield made


def _await_link(host):
    # DDS permanently ignores a port that is not up yet.
    until(lambda: 'state UP' in ip('-n', host.name, 'link', 'show', LINK))
