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

"""The command ``tf_export``: where a frame was, out of a bag into a file."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
import sys

from tf_tree_py.bag import BagError, Recording
from tf_tree_py.bag.assembling.oddities import as_text
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.trajectory import Trajectory

from .arguments import Parser
from .endings import Cannot, entry_point, FINE, FOUND
from .export.formats import BINARY, format_of, FORMATS
from .export.plan import add_frames, add_plan, planned
from .output import print_json, shown, write_file

NAME = 'tf_export'
VERSION = 1
"""Of the shape of --json; it changes only if a key goes or gets another meaning."""

_DESCRIPTION = """\
Writes where the frame SOURCE was in the frame TARGET, out of a bag of ROS 2 or ROS 1,
without ROS: a line for each stamp, with position and quaternion (TARGET_T_SOURCE).

The exit status is 0 if all went well, 1 if something is odd in the bag (standard error
tells what), 2 if there is nothing to write."""

_EXAMPLES = (
    ('tf_export run.mcap map camera -o camera.tum', 'a trajectory for evo'),
    ('tf_export run.mcap map camera --at /camera/image_raw --format csv', 'a line per image'),
    ('tf_export run.mcap odom base --rate 50 --twist -o base.npz', 'velocities, too'),
)


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('bag', metavar='BAG', type=Path, help='a file, or a folder, with a bag')
    add_frames(parser)
    add_plan(parser)
    parser.add_argument('--format', choices=[*FORMATS], help='that of the suffix of FILE, and '
                        'tum for others, unless given')
    parser.add_argument('-o', '--output', metavar='FILE', type=Path,
                        help='standard output unless given')
    parser.add_json()
    return parser


def _work(argv: Sequence[str]) -> int:
    parser = _parser()
    arguments = parser.parse(argv)
    form = arguments.format or format_of(arguments.output.suffix if arguments.output else '')
    if arguments.output is None and (form in BINARY or arguments.json):
        parser.error(f'-o FILE is missing: {"--json" if arguments.json else form} '
                     'does not go together with the poses on standard output')
    try:
        taken, recording = planned(arguments).of(arguments.bag)
    except (BagError, TransformException) as error:
        raise Cannot(str(error)) from error
    _write(FORMATS[form](taken), arguments.output)
    if arguments.json:
        print_json(_report(taken, recording, arguments))
    _remark(taken, recording, arguments)
    return FOUND if recording.oddities else FINE


def _write(data: bytes, path: Path | None) -> None:
    if path is None:
        sys.stdout.buffer.write(data)
        return
    try:
        write_file(path, data)
    except OSError as error:
        raise Cannot(f'{path} cannot be written: {error.strerror}') from error


def _remark(taken: Trajectory, recording: Recording, arguments: Namespace) -> None:
    """Tell on standard error what is not as one may think."""
    lines = (as_text(recording.path, recording.oddities).splitlines()
             if recording.oddities else [])
    if taken.outside:
        became = 'are left out' if arguments.outside == 'skip' else 'have NaN'
        lines.append(f'{taken.outside} stamps have no transform, and {became}')
    for line in lines:
        print(f'{NAME}: {shown(line)}', file=sys.stderr)


def _report(taken: Trajectory, recording: Recording,
            arguments: Namespace) -> dict[str, object]:
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
