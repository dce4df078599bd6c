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

"""The command ``tf_record``: the last seconds of a tree as a bag, when it matters."""

from argparse import ArgumentTypeError, Namespace
from collections.abc import Iterator, Sequence
from contextlib import nullcontext, suppress
import os
from pathlib import Path
from queue import SimpleQueue
import sys
import time

from tf_tree_py.core.checks.catalogue import CODES
from tf_tree_py.core.checks.finding import Finding, Severity
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.flight_recorder import FlightRecorder, Happened, LOOKUP_FAILED
from tf_tree_py.core.stamp import from_seconds

from .arguments import add_number, frame, Parser
from .dump_requests import DumpRequests
from .endings import Cannot, entry_point, FINE, FOUND, needs
from .output import print_json_line, shown
from .source import nothing_arrived, open_source, TreeSource

NAME = 'tf_record'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

ASKED = 'asked'
_DESCRIPTION = f"""\
Keeps the last seconds of a tree in memory, and writes them as a bag when it is told to
(Enter, SIGUSR1, or the service ~/dump of the node {NAME}) or when something happens
that --on names. A JSON file beside each bag says what happened; the bag's metadata too.

Of a recording it cuts out what is around each finding; without --on, its last seconds.
The exit status is 0 if nothing of --on happened, 1 if something did, 2 if nothing could be
watched. Ctrl-C ends."""

_EXAMPLES = (
    (f'{NAME} -o incidents', 'write the last 30 s when Enter is pressed'),
    (f'{NAME} --on loop,two_parents,gap -o incidents', 'or when that is found'),
    (f'{NAME} --on lookup_failed --lookup map base_link', 'or when that is lost'),
    (f'{NAME} --bag night.mcap --on pose_jump', 'cut it out of a long recording'),
)
# Seconds from one look to the next, and the age of the data that is then looked up: it has had
# time to arrive.
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
                        help='where the bags go; made if it is not there')
    parser.add_argument('--on', metavar='CODES', type=_codes, default=frozenset(),
                        help=f'codes of tf_doctor --list, and {LOOKUP_FAILED}, with commas')
    parser.add_argument('--lookup', metavar=('TARGET', 'SOURCE'), nargs=2, type=frame,
                        action='append', default=[], help=f'what to look up for {LOOKUP_FAILED}')
    add_number(parser, '--every', 60.0, 'write at most one bag in so many seconds')
    add_number(parser, '--keep', 10.0, 'how many bags stay; the oldest are removed')
    add_number(parser, '--seconds', None, 'end after so long')
    parser.add_json()
    parser.add_source()
    return parser


def _work(argv: Sequence[str]) -> int:
    arguments = _parser().parse(argv)
    if (LOOKUP_FAILED in arguments.on) != bool(arguments.lookup):
        raise Cannot(f'--on {LOOKUP_FAILED} and --lookup TARGET SOURCE belong together')
    # What it takes to write bags should be missed now, and not when it matters.
    needs('rosbags.rosbag2', 'rosbags', 'bag')
    try:
        arguments.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Cannot(f'{arguments.output} is no folder for bags: {error.strerror}') from error
    teller = _Teller(arguments.json)
    recorder = FlightRecorder(
        arguments.output, last=from_seconds(arguments.last), notify=teller.tell,
        every=from_seconds(arguments.every), keep=max(1, round(arguments.keep)))
    doctor = Doctor()
    with open_source(arguments, NAME, [doctor, recorder],
                     cache_time=doctor.limits.cache_time) as source:
        with suppress(KeyboardInterrupt):
            _watch(source, recorder, teller, _Watcher(source, doctor, arguments), arguments)
        recorder.close()
        teller.print_all()
        if not doctor.transforms:
            raise nothing_arrived(source)
    return FOUND if teller.found else FINE


def _watch(source: TreeSource, recorder: FlightRecorder, teller: '_Teller',
           watcher: '_Watcher', arguments: Namespace) -> None:
    """Write whenever somebody asks, or something is found, until it ends."""
    live, begin = arguments.bag is None, time.monotonic()
    requests = DumpRequests() if live else None
    served = live and arguments.fleet is None and arguments.fleet_config is None
    if requests is not None and not arguments.json:
        others = ' or the service ~/dump' if served else ''
        print(f'keeping the last {arguments.last:g} s of {shown(source.name)}; Enter, SIGUSR1 '
              f'(kill -USR1 {os.getpid()}){others} writes them to {arguments.output}/', flush=True)
    with requests.served_as(NAME) if requests and served else nullcontext():
        while True:
            more = source.watch(_PERIOD_S)
            for who in requests.take() if requests else ():
                recorder.write(watcher.happened(ASKED, f'asked for by {who}'))
            for finding in watcher.new_findings():
                recorder.write(watcher.happened(finding.code, finding.summary, finding.frames))
            watcher.look_up()
            teller.print_all()
            if not more:
                break
            if live and arguments.seconds and time.monotonic() - begin >= arguments.seconds:
                return
    if not arguments.on:
        recorder.write(watcher.happened(ASKED, 'the end of the recording'))


class _Watcher:
    """Knows what was found before, so that each thing is told once."""

    def __init__(self, source: TreeSource, doctor: Doctor, arguments: Namespace) -> None:
        self._source, self._doctor = source, doctor
        self._codes, self._pairs = arguments.on - {LOOKUP_FAILED}, arguments.lookup
        self._known: set[tuple[str, tuple[str, ...]]] = set()

    def new_findings(self) -> Iterator[Finding]:
        """Yield what is among the codes to look for, and was not found before."""
        for finding in self._findings() if self._codes else ():
            key = finding.code, finding.frames
            if finding.code in self._codes and key not in self._known:
                self._known.add(key)
                yield finding

    def look_up(self) -> None:
        """Look up what was asked for; the recorder hears what fails."""
        for target, source in self._pairs:
            with suppress(TransformException):
                self._source.buffer.lookup_at(
                    target, source, self._source.now() - from_seconds(_AGE_S))

    def happened(self, why: str, summary: str, frames: tuple[str, ...] = ()) -> Happened:
        """Return what is written down beside a bag."""
        return Happened(why, summary, self._source.now(), frames,
                        [one.as_dict() for one in self._findings()])

    def _findings(self) -> list[Finding]:
        self._doctor.endpoints = self._source.endpoints()
        return [one for one in self._doctor.findings() if one.severity is not Severity.NOTE]


class _Teller:
    """
    Prints what was written, and why; the recorder tells it from any thread.

    :ivar found: whether something happened that nobody asked for.
    """

    def __init__(self, as_json: bool) -> None:
        self.found = False
        self._as_json = as_json
        self._told: SimpleQueue[tuple[Happened, Path | None, str]] = SimpleQueue()

    def tell(self, happened: Happened, path: Path | None, why_not: str) -> None:
        """Take note of a bag, or of why there is none."""
        self._told.put((happened, path, why_not))

    def print_all(self) -> None:
        """Print what was told since the last time."""
        while not self._told.empty():
            happened, path, why_not = self._told.get()
            self.found = self.found or happened.why != ASKED
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
