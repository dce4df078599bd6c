# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The command ``tf_record``: writes the last seconds of a tree as a bag, when it matters.

It is requested to write by Enter, a signal, and, if there is ROS, a service.
"""

from argparse import ArgumentTypeError, Namespace
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
import math
import os
from pathlib import Path
from queue import SimpleQueue
import signal
import sys
import threading
import time

from tf_tree_py.command import signals
from tf_tree_py.command.arguments import add_number, Parser, print_json_line, shown
from tf_tree_py.command.endings import CANNOT, Cannot, entry_point, FINE, FOUND, needs
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.recording.flight_recorder import (
    FlightRecorder,
    Happened,
    LOOKUP_FAILED,
    NOTHING,
    TOO_SOON,
)

from .inputs import nothing_arrived, TreeInput
from .tree_input import add_input, frame, open_input

# The time between two requests of one sender, seconds.
_APART_S = 1.0


class DumpRequests:
    """
    The requests for a recording since the last call of ``pop``; from any thread.

    Each sender makes at most one request a second; further ones are counted in it, because
    anyone may call the service, at any rate.

    :ivar SIGNAL: the signal that requests one.
    """

    SIGNAL = signal.SIGUSR1

    def __init__(self) -> None:
        """Listen for Enter and the signal from now on; in the main thread."""
        # A queue, because a signal may come in the middle of any line.
        self._asked: SimpleQueue[str] = SimpleQueue()
        self._counts: Counter[str] = Counter()
        self._taken_at: dict[str, float] = {}
        signal.signal(self.SIGNAL, lambda *_: self._asked.put('SIGUSR1'))
        # A terminal would stop a background process that reads it; with this the read fails
        # instead.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._read, name='Enter', daemon=True).start()

    def pop(self) -> list[str]:
        """Return the senders of the requests since the last call, with their numbers."""
        now = time.monotonic()
        while not self._asked.empty():
            self._counts[self._asked.get()] += 1
        due = [who for who in self._counts if now >= self._taken_at.get(who, -math.inf) + _APART_S]
        self._taken_at.update(dict.fromkeys(due, now))
        counts = {who: self._counts.pop(who) for who in due}
        return [who if count == 1 else f'{who}, {count} times' for who, count in counts.items()]

    def _read(self) -> None:
        with suppress(OSError, ValueError):
            for _ in sys.stdin or ():
                self._asked.put('Enter')

    @contextmanager
    def served_as(self, name: str) -> Iterator[None]:
        """Serve ``~/dump`` of a node in the meantime; rclpy has to be initialised."""
        from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
        from rclpy.node import Node
        from std_srvs.srv import Trigger
        node = Node(name)
        executor = SingleThreadedExecutor()
        executor.add_node(node)

        def dump(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            self._asked.put('~/dump')
            response.success, response.message = True, 'the bag will be written shortly'
            return response

        def spin() -> None:
            with suppress(ExternalShutdownException):
                executor.spin()

        node.create_service(Trigger, '~/dump', dump)
        thread = threading.Thread(target=spin, name='~/dump')
        thread.start()
        try:
            yield
        finally:
            executor.shutdown()
            thread.join()
            node.destroy_node()


# --- the command

NAME = 'tf_record'
VERSION = 1
"""The version of --json; it changes only if a key is removed or gets another meaning."""

ASKED = 'asked'
_DESCRIPTION = f"""\
Keeps the last seconds of a tree in memory. Writes them as a bag on request (Enter,
SIGUSR1, or the service ~/dump of the node {NAME}) or when an event that --on names
occurs. A JSON file beside each bag and the bag's metadata describe the event.

From a recording it extracts the time around each finding; without --on, the last seconds.
The exit status is 0 if no event of --on occurred, 1 if one did, 2 if no transforms could
be received. Press Ctrl-C to stop."""

_EXAMPLES = (
    (f'{NAME} -o incidents', 'write the last 30 s when Enter is pressed'),
    (f'{NAME} --on loop,two_parents,gap -o incidents', 'or when one of these findings appears'),
    (f'{NAME} --on lookup_failed --lookup map base_link', 'or when this lookup fails later'),
    (f'{NAME} --bag night.mcap --on pose_jump', 'extract it from a long recording'),
)
# The seconds between two checks, and the age of the data that they look up: it has had time to
# arrive.
_PERIOD_S, _AGE_S = 0.5, 1.0


def _codes(text: str) -> frozenset[str]:
    codes = frozenset(filter(None, text.split(',')))
    unknown = sorted(codes - CODES.keys() - {LOOKUP_FAILED})
    if unknown:
        raise ArgumentTypeError(f'{unknown[0]!r} is neither {LOOKUP_FAILED} nor a code of '
                                'tf_doctor --list')
    return codes


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    add_number(parser, '--last', 30.0, 'how many seconds to keep in memory')
    parser.add_argument('-o', '--output', metavar='FOLDER', type=Path, default=Path(),
                        help='the folder for the bags; created if missing')
    parser.add_argument('--on', metavar='CODES', type=_codes, default=frozenset(),
                        help=f'codes of tf_doctor --list, and {LOOKUP_FAILED}, comma-separated')
    parser.add_argument('--lookup', metavar=('TARGET', 'SOURCE'), nargs=2, type=frame,
                        action='append', default=[], help=f'what to look up for {LOOKUP_FAILED}')
    add_number(parser, '--every', 60.0, 'write at most one bag in this many seconds')
    add_number(parser, '--keep', 10.0, 'how many bags to keep; the oldest are removed')
    add_number(parser, '--seconds', None, 'stop after this many seconds')
    parser.add_json()
    add_input(parser)
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if (LOOKUP_FAILED in arguments.on) != bool(arguments.lookup):
        raise Cannot(f'--on {LOOKUP_FAILED} and --lookup TARGET SOURCE must be used together')
    # A missing package has to be reported now, and not when a bag has to be written.
    needs('rosbags.rosbag2', 'rosbags')
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Cannot(f'{arguments.output} cannot hold bags: {error.strerror}') from error
    status_line = _StatusLine(arguments.json)
    recorder = FlightRecorder(
        arguments.output, last=from_seconds(arguments.last), notify=status_line.note,
        every=from_seconds(arguments.every), keep=max(1, round(arguments.keep)))
    doctor = Doctor()
    with open_input(arguments, NAME, [doctor, recorder],
                    cache_time=doctor.limits.cache_time) as tree_input:
        with suppress(KeyboardInterrupt):
            watcher = _Watcher(tree_input, doctor, arguments)
            _watch(tree_input, recorder, status_line, watcher, arguments)
        recorder.close()
        status_line.print_all()
        if not doctor.transforms:
            raise nothing_arrived(tree_input)
    return CANNOT if status_line.failed else FOUND if status_line.found else FINE


def _watch(tree_input: TreeInput, recorder: FlightRecorder, status_line: '_StatusLine',
           watcher: '_Watcher', arguments: Namespace) -> None:
    """Write a bag at each request and each new finding, until the end."""
    live, begin = arguments.bag is None, time.monotonic()
    requests = DumpRequests() if live else None
    served = live and arguments.fleet is None and arguments.fleet_config is None
    if requests is not None and not arguments.json:
        others = ' or the service ~/dump' if served else ''
        print(f'keeping the last {arguments.last:g} s of {shown(tree_input.name)}; Enter, SIGUSR1 '
              f'(kill -USR1 {os.getpid()}){others} writes them to {arguments.output}/', flush=True)
    with requests.served_as(NAME) if requests and served else nullcontext():
        while True:
            more = tree_input.watch(_PERIOD_S)
            for who in requests.pop() if requests else ():
                _write(recorder, watcher.happened(ASKED, f'requested by {who}'))
            for finding in watcher.new_findings():
                _write(recorder, watcher.happened(finding.code, finding.summary, finding.frames))
            watcher.look_up()
            status_line.print_all()
            if not more:
                break
            if live and arguments.seconds and time.monotonic() - begin >= arguments.seconds:
                return
    if not arguments.on:
        _write(recorder, watcher.happened(ASKED, 'the end of the recording'))


def _write(recorder: FlightRecorder, happened: Happened) -> None:
    """Write a bag; Ctrl-C ends the wait for it, and not the writing."""
    recorder.write_soon(happened).wait()


class _Watcher:
    """A record of earlier findings, so that each is reported once."""

    def __init__(self, tree_input: TreeInput, doctor: Doctor, arguments: Namespace) -> None:
        self._tree_input, self._doctor = tree_input, doctor
        self._codes, self._pairs = arguments.on - {LOOKUP_FAILED}, arguments.lookup
        self._known: set[tuple[str, tuple[str, ...]]] = set()

    def new_findings(self) -> Iterator[Finding]:
        """Yield the findings with the requested codes that are new."""
        for finding in self._findings() if self._codes else ():
            key = finding.code, finding.frames
            if finding.code in self._codes and key not in self._known:
                self._known.add(key)
                yield finding

    def look_up(self) -> None:
        """Make the requested lookups; the recorder is notified of failures."""
        for target, source in self._pairs:
            with suppress(TransformException):
                self._tree_input.buffer.lookup_at(
                    target, source, self._tree_input.now() - from_seconds(_AGE_S))

    def happened(self, why: str, summary: str, frames: tuple[str, ...] = ()) -> Happened:
        """Return the description of an event, for the file beside a bag."""
        return Happened(why, summary, self._tree_input.now(), frames,
                        [one.as_dict() for one in self._findings()])

    def _findings(self) -> list[Finding]:
        self._doctor.endpoints = self._tree_input.endpoints()
        self._doctor.graph = self._tree_input.graph()
        return [one for one in self._doctor.findings() if one.severity is not Severity.NOTE]


class _StatusLine:
    """
    Prints which bags were written, and why; the recorder calls it from any thread.

    :ivar found: whether an event occurred other than a request.
    :ivar failed: whether a bag could not be written.
    """

    def __init__(self, as_json: bool) -> None:
        self.found = self.failed = False
        self._as_json = as_json
        self._dumps: SimpleQueue[tuple[Happened, Path | None, str]] = SimpleQueue()

    def note(self, happened: Happened, path: Path | None, why_not: str) -> None:
        """Record a bag, or the reason why there is none."""
        self._dumps.put((happened, path, why_not))

    def print_all(self) -> None:
        """Print the records since the last call."""
        while not self._dumps.empty():
            with signals.deferred():  # a record that is taken has to be printed
                self._print(*self._dumps.get())

    def _print(self, happened: Happened, path: Path | None, why_not: str) -> None:
        self.found = self.found or happened.why != ASKED
        self.failed = self.failed or (path is None and why_not not in (TOO_SOON, NOTHING))
        if self._as_json:
            print_json_line({
                'version': VERSION, 'why': happened.why, 'stamp': happened.stamp,
                'summary': happened.summary, 'frames': list(happened.frames),
                'bag': None if path is None else str(path), 'why_not': why_not})
        else:
            outcome = str(path) if path else f'not written, {why_not}'
            print(shown(f'{outcome}: {happened.why}: {happened.summary}', 500), flush=True)


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
