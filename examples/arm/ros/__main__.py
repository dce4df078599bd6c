# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Run the arm in ROS: ``scripts/arm --ros``.

This process runs the arm's node. It starts the process of the simulated arm (with the Python
that $TF_TREE_PY_ARM_PYTHON names), the broadcaster of the arm's URDF, and perception.
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
    # When the terminal is closed, the other processes must also end.
    signal.signal(signal.SIGHUP, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
    return run(NAME, [NAME], lambda ended: play(arguments, ended))


def play(arguments: argparse.Namespace, ended: Future) -> None:
    """Start everything, report each run, and end everything."""
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
    """Start the arm's process in another environment; return this end of the pipe."""
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
    """Start the processes that any arm needs: the URDF broadcaster, and perception."""
    file.write_text(urdf)
    children.start('urdf_broadcaster', [
        sys.executable, '-m', 'tf_tree_py.nodes.urdf_broadcaster', '--urdf', str(file),
        '--ros-args', '--log-level', 'warn', '-p', 'use_sim_time:=true',
        '-p', 'publish_frequency:=1000.0'])
    children.start('perception', [sys.executable, '-m', f'{__package__}.perception_node'])


def wait_for_everybody(node: ArmNode, children: Children, ended: Future) -> None:
    """
    Return when all processes are connected.

    :raises BadInput: a process has ended, or is not connected after a minute.
    """
    deadline = time.monotonic() + _PATIENCE_S
    while not (node.everybody_is_there() or ended.done()):
        children.check()
        if time.monotonic() > deadline:
            raise BadInput(f'the processes did not find each other within {_PATIENCE_S:g} s')
        time.sleep(_GLANCE_S)


def received(pipe: Connection, children: Children, ended: Future) -> Iterator[Any]:
    """
    Yield the messages from the arm, until Ctrl-C.

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
    """Publish the messages from the arm; yield the result of each run."""
    for message in messages:
        if not isinstance(message, Trial):
            node.publish(message)
            continue
        yield message
        count -= 1
        if not count:
            return


def tell(arguments: argparse.Namespace, outcome: Iterator[Trial]) -> None:
    """Print the result of each run as soon as it ends, and a summary; or JSON."""
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
