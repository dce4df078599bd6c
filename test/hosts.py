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
Two hosts as far as the network can tell, and a link between them.

Each is a network namespace of its own; a pair of virtual ports joins the two and nothing
else, so no traffic leaves this machine. It needs root.
"""

from contextlib import closing, contextmanager, ExitStack
import os
import shutil
import subprocess
import sys
import textwrap
import time

from programs import PATIENCE_S
import pytest

LINK = 'link0'


def ip(*arguments):
    """Run the command; return what it prints."""
    return subprocess.run(['ip', *arguments], check=True, capture_output=True, text=True,
                          timeout=PATIENCE_S).stdout


class Host:
    """A network namespace, and the program that runs there: a line in, a line out."""

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
        """Give the program a line; return what it answers."""
        print(line, file=self._process.stdin, flush=True)
        return self._process.stdout.readline().strip()

    def raise_link(self):
        """Give the port of the link the host's address, and set it up."""
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
    """Yield two hosts that nothing joins; skip where they cannot be."""
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
    """Yield two hosts, joined by a link; skip where they cannot be."""
    with two_apart() as made:
        ip('-n', made[0].name, 'link', 'add', LINK, 'type', 'veth',
           'peer', LINK, 'netns', made[1].name)
        for host in made:
            host.raise_link()
        for host in made:
            _await_link(host)
        yield made


def _await_link(host):
    # DDS takes a port that is not up yet for one that never will be.
    end = time.monotonic() + PATIENCE_S
    while 'state UP' not in ip('-n', host.name, 'link', 'show', LINK):
        assert time.monotonic() < end, 'the link never came up'
        time.sleep(0.002)
