# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_export``: the poses of a frame, from a bag into a file."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
import sys

from tf_tree_py.bag import BagError, Recording
from tf_tree_py.bag.assembly.assembler import as_text
from tf_tree_py.beyond.motion.trajectory import Trajectory
from tf_tree_py.command import signals
from tf_tree_py.command.arguments import Parser, print_json, shown
from tf_tree_py.command.endings import cannot_after, cannot_be, entry_point, FINE, FOUND
from tf_tree_py.core.errors import TransformException
from tf_tree_py.files.whole_files import write_whole

from .export.formats import BINARY, format_of, FORMATS
from .export.plan import add_frames, add_plan, planned

NAME = 'tf_export'
VERSION = 1
"""The version of --json; it changes only if a key is removed or gets another meaning."""

# An anomaly ends with what to do.
_LONGEST_LINE = 1000

_DESCRIPTION = """\
Writes the poses of the frame SOURCE in the frame TARGET from a bag of ROS 2 or ROS 1,
without ROS: one line per stamp, with position and quaternion (TARGET_T_SOURCE).

The exit status is 0 if all went well, 1 if something in the bag is odd (reported on
standard error), 2 if there is nothing to write."""

_EXAMPLES = (
    ('tf_export run.mcap map camera -o camera.tum', 'a trajectory for evo'),
    ('tf_export run.mcap map camera --at /camera/image_raw --format csv', 'a line per image'),
    ('tf_export run.mcap odom base --rate 50 --twist -o base.npz', 'with velocities'),
)


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('bag', metavar='BAG', type=Path, help='a bag: a file or a folder')
    add_frames(parser)
    add_plan(parser)
    parser.add_argument('--format', choices=[*FORMATS], help='the file format (default: by '
                        'the suffix of FILE, otherwise tum)')
    parser.add_argument('-o', '--output', metavar='FILE', type=Path,
                        help='the file to write (default: standard output)')
    parser.add_json()
    return parser


def _work(argv: Sequence[str]) -> int:
    parser = _parser()
    arguments = parser.parse(argv)
    suffix = arguments.output.suffix if arguments.output else ''
    form = arguments.format or format_of(suffix)
    if form is None:
        parser.error(f'--format is missing: the suffix {suffix} is that of no format')
    if arguments.output is None and (form in BINARY or arguments.json):
        parser.error(f'-o FILE is missing: with {"--json" if arguments.json else form}, '
                     'the poses cannot go to standard output')
    with cannot_after(BagError, TransformException):
        plan = planned(arguments)
        signals.raise_interrupts()
        taken, recording = plan.of(arguments.bag)
    _write(FORMATS[form](taken), arguments.output)
    if arguments.json:
        print_json(_report(taken, recording, arguments))
    _remark(taken, recording, arguments)
    return FOUND if recording.oddities else FINE


def _write(data: bytes, path: Path | None) -> None:
    if path is None:
        sys.stdout.buffer.write(data)
        return
    with cannot_be('written', path):
        write_whole(path, [data])


def _remark(taken: Trajectory, recording: Recording, arguments: Namespace) -> None:
    """Report the oddities, and stamps without a transform, on standard error."""
    lines = (as_text(recording.path, recording.oddities).splitlines()
             if recording.oddities else [])
    if taken.outside:
        became = 'are left out' if arguments.outside == 'skip' else 'have NaN'
        lines.append(f'{taken.outside} stamps have no transform, and {became}')
    for line in lines:
        print(f'{NAME}: {shown(line, _LONGEST_LINE)}', file=sys.stderr)


def _report(taken: Trajectory, recording: Recording, arguments: Namespace) -> dict[str, object]:
    return {
        'version': VERSION,
        'bag': str(arguments.bag),
        'target': taken.target_frame,
        'source': taken.source_frame,
        'file': str(arguments.output),
        'poses': len(taken.stamps),
        'outside': taken.outside,
        'first_ns': int(taken.stamps.min()),
        'last_ns': int(taken.stamps.max()),
        'oddities': [str(oddity) for oddity in recording.oddities],
    }


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
