# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_view``: a tree in the browser."""

from argparse import ArgumentTypeError, Namespace
from collections.abc import Sequence
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
import re
import secrets
import socket
import sys

from tf_tree_py.command import signals
from tf_tree_py.command.arguments import Parser
from tf_tree_py.command.endings import Cannot, cannot_after, entry_point, FINE, needs
from tf_tree_py.core.stamp import UNLIMITED
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.tools.inputs import TreeInput
from tf_tree_py.tools.tree_input import add_input, open_input
from tf_tree_py.urdf import DescriptionError, Robot

from .model.moment import Remembered
from .model.playhead import IncidentLog
from .robot.resting_robot import RestingRobot
from .robot.shapes import shapes_of
from .sensors.readings import Sensors
from .sensors.recorded_sensors import RecordedSensors
from .subject import Subject

NAME = 'tf_view'

_DESCRIPTION = """\
Shows a tree, live or recorded, on a page in the browser: every frame as axes with its
name and a line to its parent, at one moment that you choose with a slider.

The page is available on this machine only, unless --host allows others. To view it from
another machine, run ssh -L 8080:localhost:8080 robot there, and open
http://localhost:8080. Press Ctrl-C to stop."""

_EXAMPLES = (
    ('tf_view', 'view the running robot'),
    ('tf_view --bag run.mcap', 'view a recording, without ROS'),
    ('tf_view --urdf robot.urdf', 'with the shapes of its links'),
)
_PORT = 8080
_TOKEN = re.compile(r'[A-Za-z0-9_-]{8,200}')


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('--urdf', metavar='FILE', type=Path,
                        help='a robot description; its links are drawn on their frames')
    parser.add_argument('--fixed-frame', metavar='F', help='the frame to draw everything in '
                        '(default: the root with the most frames below it)')
    parser.add_argument('--port', metavar='N', type=int, help=f'the port of the page '
                        f'(default: {_PORT}, or the next one that is free)')
    parser.add_argument('--host', metavar='ADDRESS', default='127.0.0.1',
                        help='the address of the page (default 127.0.0.1); everyone who '
                        'can reach it sees the page; 0.0.0.0 is all addresses of this machine')
    parser.add_argument('--token', metavar='WORD', nargs='?', const='', type=_token,
                        help='require a secret in the address of the page: WORD, or a new '
                        'random one; recommended with --host')
    add_input(parser)
    return parser


def _token(word: str) -> str:
    """Return a word of the command line that is valid in an address and in a cookie."""
    if not _TOKEN.fullmatch(word):
        raise ArgumentTypeError(f'{word!r} is not a token: use at least 8 letters, digits, - or _')
    return word


def _work(argv: Sequence[str]) -> int:
    parser = _parser()
    arguments = parser.parse(argv)
    if arguments.port is not None and not 0 < arguments.port < 65536:
        parser.error(f'argument --port: {arguments.port} is not a number from 1 to 65535')
    needs('viser', 'viser')
    from . import serving  # noqa: F401 - slow, so import it while Ctrl-C still ends the program
    _check_address(arguments.host, arguments.port)
    robot = None if arguments.urdf is None else _robot(arguments.urdf)
    doctor, incidents = Doctor(recorded=arguments.bag is not None), IncidentLog()
    with suppress(KeyboardInterrupt), open_input(
            arguments, NAME, [doctor, incidents], cache_time=UNLIMITED) as tree_input:
        if arguments.bag is not None:
            tree_input.watch(None)
            _check_recording(tree_input)
        subject = _subject(arguments, tree_input, doctor)
        subject.incidents = incidents
        if robot is not None:
            _show_robot(subject, robot, arguments.urdf)
            if arguments.bag is None:
                subject.resting = RestingRobot(robot)
                subject.name = f'{arguments.urdf.name}, {subject.name}'
        with closing(_sensors(arguments, tree_input, subject)) as subject.sensors:
            _serve(arguments, tree_input, subject)
    return FINE


def _sensors(arguments: Namespace, tree_input: TreeInput, subject: Subject) -> Sensors:
    """Return the sensor messages, which also have the robot's description."""
    def show(text: str) -> None:
        try:
            robot = Robot.parse(text)
        except DescriptionError as error:
            subject.missing = [f'/robot_description: {error}']
            return
        _show_robot(subject, robot, Path('robot_description'))

    described = show if arguments.urdf is None else None
    if arguments.bag is not None:
        return RecordedSensors(arguments.bag, described)
    node = getattr(tree_input, 'node', None)
    if node is None:
        return Sensors()  # a fleet sends only transforms
    from .sensors.live_sensors import LiveSensors
    return LiveSensors(node, described)


def _subject(arguments: Namespace, tree_input: TreeInput, doctor: Doctor) -> Subject:
    name = tree_input.name
    if arguments.bag is not None:
        name = Path(name).name or name
    return Subject(tree_input.buffer, arguments.bag is None, tree_input.now,
                   partial(tree_input.findings, doctor), fixed_frame=arguments.fixed_frame,
                   name=name, left_behind=Remembered(doctor.left_behind))


def _serve(arguments: Namespace, tree_input: TreeInput, subject: Subject) -> None:
    """Serve pages until Ctrl-C."""
    from .serving import Serving
    token = secrets.token_urlsafe() if arguments.token == '' else arguments.token
    with Serving(subject, arguments.host, arguments.port or _PORT, subject.name,
                 token or '') as serving:
        print(f'{NAME}: {tree_input.name} is shown at {serving.url} (Ctrl-C to stop)', flush=True)
        signals.wait()


def _check_recording(tree_input: TreeInput) -> None:
    for sentence in tree_input.damage():
        print(f'{NAME}: {sentence}', file=sys.stderr)
    if not tree_input.buffer.frames():
        raise Cannot(f'{tree_input.name} contains no transforms')


def _check_address(host: str, port: int | None) -> None:
    """
    Check that the server can listen on an address.

    :param port: None: any free port will do.
    :raises Cannot: it cannot; the error is one sentence.
    """
    family = socket.AF_INET6 if ':' in host else socket.AF_INET
    try:
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port or 0))
    except OSError as error:
        where = host if port is None else f'{host}:{port}'
        raise Cannot(f'cannot listen on {where}: {error.strerror or error}') from error


def _robot(path: Path) -> Robot:
    with cannot_after(DescriptionError, OSError):
        return Robot.load(path)


def _show_robot(subject: Subject, robot: Robot, path: Path) -> None:
    """Let pages show the links of a robot, and print what of it is ignored or cannot be shown."""
    subject.shapes, missing = shapes_of(robot, path)
    subject.missing = [*robot.warnings, *missing]
    for sentence in subject.missing:
        print(f'{NAME}: {sentence}', file=sys.stderr)


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
