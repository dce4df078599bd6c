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

"""The command ``tf_view``: a tree in the browser."""

from argparse import Namespace
from collections.abc import Sequence
from contextlib import suppress
import os
from pathlib import Path
import signal
import socket
import sys

from tf_tree_py.core.checks.finding import Finding
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.stamp import UNLIMITED
from tf_tree_py.tools.arguments import Parser
from tf_tree_py.tools.endings import Cannot, entry_point, FINE, needs
from tf_tree_py.tools.source import open_source, TreeSource
from tf_tree_py.urdf import DescriptionError, Robot

from .shown.shapes import LinkShape, shapes_of
from .subject import Subject

NAME = 'tf_view'

_DESCRIPTION = """\
Shows a tree, live or recorded, on a page that any browser opens: every frame as
axes with its name and a line to its parent, at one moment, which a slider chooses.

It answers on this machine only, unless --host says more. From another one:
ssh -L 8080:localhost:8080 robot, and open http://localhost:8080 here. Ctrl-C ends."""

_EXAMPLES = (
    ('tf_view', 'look at the running robot'),
    ('tf_view --bag run.mcap', 'look at a recording, without ROS'),
    ('tf_view --urdf robot.urdf', 'with the shapes of its links'),
)
_PORT = 8080


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('--urdf', metavar='FILE', type=Path,
                        help='a robot description, whose links are drawn on their frames')
    parser.add_argument('--fixed-frame', metavar='F', help='what everything is seen from; the '
                        'root with the most frames below it unless given')
    parser.add_argument('--port', metavar='N', type=int, help=f'to answer on; {_PORT}, or the '
                        'next one that is free, unless given')
    parser.add_argument('--host', metavar='ADDRESS', default='127.0.0.1',
                        help='to answer on; whoever reaches it sees the page, so it is '
                        '127.0.0.1 unless given; 0.0.0.0 is all that this machine has')
    parser.add_source()
    return parser


def _work(argv: Sequence[str]) -> int:
    parser = _parser()
    arguments = parser.parse(argv)
    if arguments.port is not None and not 0 < arguments.port < 65536:
        parser.error(f'argument --port: {arguments.port} is not a number from 1 to 65535')
    needs('viser', 'viser', 'view')
    _check_address(arguments.host, arguments.port)
    shapes = _shapes(arguments.urdf)
    doctor = Doctor()
    with open_source(arguments, NAME, [doctor], cache_time=UNLIMITED) as source, \
            suppress(KeyboardInterrupt):
        if arguments.bag is not None:
            source.watch(None)
            _check_recording(source)
        _serve(arguments, source, doctor, shapes)
    return FINE


def _serve(arguments: Namespace, source: TreeSource, doctor: Doctor,
           shapes: Sequence[LinkShape]) -> None:
    """Serve pages until Ctrl-C."""
    from .serving import Serving

    def diagnose() -> Sequence[Finding]:
        doctor.endpoints = source.endpoints()
        return doctor.findings()

    subject = Subject(source.buffer, arguments.bag is None, source.now, diagnose, shapes,
                      arguments.fixed_frame)
    signalled = _signals()
    with Serving(subject, arguments.host, arguments.port or _PORT, source.name) as serving:
        print(f'{NAME}: {source.name} is to be seen at {serving.url} (Ctrl-C ends)', flush=True)
        os.read(signalled, 1)


def _signals() -> int:
    """
    Return a file that can be read as soon as a signal has come.

    Of several signals that come at once, the system may give all to other threads, which
    does not wake this one from any other wait.
    """
    read_end, write_end = os.pipe()
    os.set_blocking(write_end, False)
    signal.set_wakeup_fd(write_end, warn_on_full_buffer=False)
    return read_end


def _check_recording(source: TreeSource) -> None:
    for sentence in source.damage():
        print(f'{NAME}: {sentence}', file=sys.stderr)
    if not source.buffer.frames():
        raise Cannot(f'{source.name} holds no transform')


def _check_address(host: str, port: int | None) -> None:
    """Say in one sentence where the address cannot be had; a port that is given is meant."""
    family = socket.AF_INET6 if ':' in host else socket.AF_INET
    try:
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port or 0))
    except OSError as error:
        where = host if port is None else f'{host}:{port}'
        raise Cannot(f'cannot answer on {where}: {error.strerror or error}') from error


def _shapes(path: Path | None) -> list[LinkShape]:
    if path is None:
        return []
    try:
        robot = Robot.load(path)
    except (DescriptionError, OSError) as error:
        raise Cannot(str(error)) from error
    shapes, missing = shapes_of(robot, path)
    for sentence in missing:
        print(f'{NAME}: {sentence}', file=sys.stderr)
    return shapes


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
