# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The command ``tf_calibrate``: finds out whether a mounting or the stamps are wrong."""

from argparse import ArgumentTypeError, Namespace
from collections.abc import Sequence
import json
from pathlib import Path
import sys
import warnings

from tf_tree_py.bag import BagError, BagWarning, open_bag
from tf_tree_py.calibration import (
    calibrate,
    Calibration,
    CalibrationError,
    Limits,
    Observations,
    recorded_observations,
    Verdict,
)
from tf_tree_py.calibration.chain import check_edges, Tree
from tf_tree_py.command.arguments import add_number, Parser, print_json, shown
from tf_tree_py.command.endings import cannot_after, cannot_be, entry_point, FINE, FOUND
from tf_tree_py.core import TransformException, UNLIMITED
from tf_tree_py.files.whole_files import write_whole

from .calibrate.report import as_yaml, print_report, SUFFIXES, write_picture
from .calibrate.urdf_origin import origin_of, write_origin
from .recorded_tree import topics_of
from .tree_input import add_input, check_input, frame, open_input

NAME = 'tf_calibrate'
VERSION = 1
"""Version of the JSON; it changes only if a key is removed or changes its meaning."""

_DESCRIPTION = """\
Estimates a static edge, such as a camera's mounting, from observations of a target at rest,
and reports whether the mounting or the sensor's stamps are wrong.

The exit status is 0 if nothing is wrong, 1 if the edge or the time is wrong or the
observations cannot tell, and 2 if nothing could be estimated."""

_EXAMPLES = (
    (f'{NAME} --bag run.mcap --edge flange camera --observations /target --fixed-in base --time',
     'from a bag'),
    (f'{NAME} --bag run.mcap --edge base camera --observations tf:tag_7 --fixed-in map',
     'a tag whose frame is on /tf'),
    (f'{NAME} --seconds 60 --edge base camera --observations /target --fixed-in map --time',
     'live, while you move the robot'),
)


def _parser() -> Parser:
    parser = Parser(NAME, _DESCRIPTION, _EXAMPLES)
    parser.add_argument('--edge', nargs=2, action='append', required=True, type=frame,
                        metavar=('PARENT', 'CHILD'),
                        help='the static edge to calibrate; repeat it for several edges')
    parser.add_argument('--observations', action='append', required=True, metavar='TOPIC',
                        help='a topic of poses or points of the target, or tf:FRAME for the frame '
                        'of a tag on /tf; repeat it for several')
    parser.add_argument('--fixed-in', required=True, type=frame, metavar='FRAME',
                        help='the frame in which the target rests')
    parser.add_argument('--known', action='append', default=[], type=_known,
                        metavar='[TARGET=]FRAME', help='the target is this frame of the tree; '
                        'without it, the place of the target is estimated')
    parser.add_argument('--time', action='store_true',
                        help="also estimate how late the sensor's stamps are")
    add_number(parser, '--max-offset', Limits.max_offset_s,
               'the largest time offset to try, seconds')
    add_number(parser, '--seconds', None, 'live: how long to record (default: 60)')
    parser.add_argument('-o', '--output', action='append', default=[], type=_output,
                        metavar='PATH', help='write the edge (.yaml), the whole result (.json) '
                        f'or a picture ({", ".join(SUFFIXES)}); repeat it for several')
    parser.add_argument('--write', type=_description, metavar='URDF',
                        help="write the new origin into the joint of a robot's description if "
                        'the edge is wrong, and keep a backup')
    parser.add_json()
    add_input(parser)
    return parser


def _known(text: str) -> tuple[str, str]:
    target, _, name = text.rpartition('=')
    return target, frame(name)


def _output(text: str) -> Path:
    path = Path(text)
    if path.suffix not in ('.yaml', '.yml', '.json', *SUFFIXES):
        raise ArgumentTypeError(f'{text!r} has none of the suffixes .yaml, .json, '
                                f'{", ".join(SUFFIXES)}')
    return path


def _description(text: str) -> Path:
    if not Path(text).is_file():
        raise ArgumentTypeError(f'{text} cannot be read: there is no such file')
    return Path(text)


def _work(argv: Sequence[str]) -> int:
    parser = _parser()
    arguments = parser.parse(argv)
    check_input(arguments)
    if arguments.fleet or arguments.fleet_config:
        parser.error('--fleet sends no observations: use --bag PATH, or a live system')
    if arguments.bag and arguments.seconds:
        parser.error('--seconds is for a live system, and --bag reads all of a recording')
    with cannot_after(BagError, CalibrationError, TransformException):
        found = _recorded(arguments) if arguments.bag else _live(arguments)
    _give(found, arguments)
    return FINE if found.verdict is Verdict.NOTHING else FOUND


def _recorded(arguments: Namespace) -> Calibration:
    with warnings.catch_warnings(record=True) as odd:
        warnings.simplefilter('always', BagWarning)
        recording = open_bag(arguments.bag, topics=topics_of(arguments))
    for warning in odd:
        print(f'{NAME}: {shown(str(warning.message), 1200)}', file=sys.stderr)
    check_edges(recording, _edges(arguments))
    return estimated(recording, arguments, recorded_observations(
        recording, arguments.observations, arguments.fixed_in, dict(arguments.known)))


def _live(arguments: Namespace) -> Calibration:
    with open_input(arguments, NAME, live_cache_time=UNLIMITED) as tree_input:
        from .calibrate.live import recorded_live
        return recorded_live(tree_input, arguments, estimated)


def _edges(arguments: Namespace) -> list[tuple[str, str]]:
    return [(parent, child) for parent, child in arguments.edge]


def estimated(tree: Tree, arguments: Namespace, sets: Sequence[Observations]) -> Calibration:
    """Return the calibration with the edges and limits of the arguments."""
    return calibrate(tree, _edges(arguments), sets, time=arguments.time,
                     limits=Limits(max_offset_s=arguments.max_offset))


def _give(found: Calibration, arguments: Namespace) -> None:
    report = _report(found)
    if arguments.json:
        print_json(report)
    else:
        print_report(found, arguments.time)
    for path in arguments.output:
        _write(found, report, path)
    if arguments.write is not None:
        _write_urdf(found, arguments)


def _report(found: Calibration) -> dict[str, object]:
    return {'version': VERSION, **found.as_dict(),
            'urdf': [f'<origin {origin_of(edge.after)}/>' for edge in found.edges]}


def _write(found: Calibration, report: dict[str, object], path: Path) -> None:
    if path.suffix in SUFFIXES:
        write_picture(found, path)
    elif found.contradiction is not None and path.suffix != '.json':
        print(f'{NAME}: {path} is not written, because there is no estimate: '
              f'{found.contradiction.what}', file=sys.stderr)
        return
    else:
        text = json.dumps(report, indent=2) + '\n' if path.suffix == '.json' else as_yaml(found)
        with cannot_be('written', path):
            write_whole(path, [text.encode()])
    print(f'{NAME}: wrote {path}', file=sys.stderr)


def _write_urdf(found: Calibration, arguments: Namespace) -> None:
    if reason := _reason_to_keep(found, arguments.time):
        print(f'{NAME}: {arguments.write} is unchanged, because {reason}', file=sys.stderr)
        return
    for edge in found.edges:
        change = write_origin(arguments.write, edge.parent, edge.child, edge.after)
        print(f'{NAME}: {change.path}, line {change.line}: {change.before or "no origin"} is now '
              f'{change.after}; the backup is {change.backup}', file=sys.stderr)


def _reason_to_keep(found: Calibration, time: bool) -> str:
    """Return why the estimated edge must not go into a robot's description, or ''."""
    if found.contradiction is not None:
        return found.contradiction.what
    if not found.wants_new_edge:
        return f'the verdict is {found.verdict.value!r}'
    if found.verdict is Verdict.BOTH and not time:
        return 'the stamps are wrong, too, and the new edge would make up for them: add --time'
    if any(each.at_bound for each in found.time_offsets):
        return 'the time offset is at its bound: try again with a larger --max-offset'
    return ''


main = entry_point(NAME, _work)

if __name__ == '__main__':
    sys.exit(main())
