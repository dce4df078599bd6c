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
The arm in ROS; ``scripts/arm --ros`` runs this.

Its own part is the arm's node. It starts the arm's own process (by the Python that
$TF_TREE_PY_ARM_PYTHON names), the broadcaster that makes the tree of the arm's URDF, and
perception.
"""

import argparse
from collections.abc import Iterator
import json
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
from pathlib import Path
import signal
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any

from rclpy.task import Future
from tf_tree_py.nodes.bad_input import BadInput
from tf_tree_py.nodes.running import run, spun_in_background

from .arm_node import ArmNode
from .children import Children
from ..options import NAME, parser
from ..report import as_dict, row, summary, Trial

_PYTHON = 'TF_TREE_PY_ARM_PYTHON'
_REPOSITORY = Path(__file__).parents[3]
_PATIENCE_S = 60.0
_GLANCE_S = 0.1


def main() -> int:
    """Run the command; return its exit status."""
    arguments = parser().parse_args()
    # Somebody who closes the terminal wants the other processes to end, too.
    signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
    return run(NAME, [NAME], lambda ended: play(arguments, ended))


def play(arguments: argparse.Namespace, ended: Future) -> None:
    """Start everything, tell what comes of each run, and end everything."""
    with TemporaryDirectory() as folder, Children() as children:
        pipe = start_arm(children, arguments)
        messages = received(pipe, children, ended)
        hello = next(messages, None)
        if hello is None:
            return
        start_others(children, hello.urdf, Path(folder, 'arm.urdf'))
        node = ArmNode(hello, pipe)
        with spun_in_background(node):
            wait_for_everybody(node, children, ended)
            pipe.send('begin')
            tell(arguments, trials(node, messages, arguments.runs))


def start_arm(children: Children, arguments: argparse.Namespace) -> Connection:
    """Start the arm's own process, in another environment than ours; return our end of a pipe."""
    ours, theirs = Pipe()
    children.start(
        'the arm',
        [_python_of_arm(), '-m', f'{__package__}.hardware',
         *map(str, (theirs.fileno(), arguments.runs, arguments.seed))],
        pass_fds=[theirs.fileno()],
        env={'PATH': os.environ['PATH'], 'PYTHONPATH': str(_REPOSITORY)})
    theirs.close()
    return ours


def _python_of_arm() -> str:
    python = os.environ.get(_PYTHON, '')
    if not Path(python).is_file():
        raise BadInput(f'{_PYTHON} names no Python with PyBullet; scripts/arm --ros sets it')
    return python


def start_others(children: Children, urdf: str, file: Path) -> None:
    """Start what is there for any arm: the tree of its URDF, and perception."""
    file.write_text(urdf)
    children.start('urdf_broadcaster', [
        sys.executable, '-m', 'tf_tree_py.nodes.urdf_broadcaster', '--urdf', str(file),
        '--ros-args', '--log-level', 'warn', '-p', 'use_sim_time:=true',
        '-p', 'publish_frequency:=1000.0'])
    children.start('perception', [sys.executable, '-m', f'{__package__}.perception_node'])


def wait_for_everybody(node: ArmNode, children: Children, ended: Future) -> None:
    """
    Return when all have found each other.

    :raises BadInput: somebody ended, or is still not there after a minute.
    """
    deadline = time.monotonic() + _PATIENCE_S
    while not (node.everybody_is_there() or ended.done()):
        children.check()
        if time.monotonic() > deadline:
            raise BadInput(f'after {_PATIENCE_S:g} s not everybody has found everybody')
        time.sleep(_GLANCE_S)


def received(pipe: Connection, children: Children, ended: Future) -> Iterator[Any]:
    """
    Yield what the arm sends, until Ctrl-C.

    :raises BadInput: a process has ended.
    """
    while not ended.done():
        try:
            if pipe.poll(_GLANCE_S):
                yield pipe.recv()
            else:
                children.check()
        except (EOFError, ConnectionResetError):
            raise BadInput('the process of the arm has ended') from None


def trials(node: ArmNode, messages: Iterator[Any], count: int) -> Iterator[Trial]:
    """Publish what the arm sends; yield what came of each run."""
    for message in messages:
        if not isinstance(message, Trial):
            node.publish(message)
            continue
        yield message
        count -= 1
        if not count:
            return


def tell(arguments: argparse.Namespace, outcome: Iterator[Trial]) -> None:
    """Print what came of each run, as soon as it is over, and of all; or JSON."""
    done = []
    for trial in outcome:
        done.append(trial)
        if not arguments.json:
            print(row(trial), flush=True)
    if not done:  # Ctrl-C
        return
    print(json.dumps({'seed': arguments.seed, **as_dict('ros', done)}, indent=2)
          if arguments.json else summary(done))


if __name__ == '__main__':
    sys.exit(main())
