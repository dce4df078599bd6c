# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Replaces the origin of one joint in a URDF file, and keeps every other byte."""

from pathlib import Path
import re
from typing import NamedTuple
from xml.parsers import expat

from tf_tree_py.command.endings import Cannot, cannot_be
from tf_tree_py.core import Pose
from tf_tree_py.files.whole_files import write_whole

_TAG = rb'(?:[^>"\']|"[^"]*"|\'[^\']*\')*>'
# One attribute. The value is searched with its name, because a value may contain any text.
_ATTRIBUTE = re.compile(rb'([\w.:-]+)(\s*=\s*)("[^"]*"|\'[^\']*\')')


class Change(NamedTuple):
    """A change of a file: its place, and the text before and after."""

    path: Path
    backup: Path
    line: int
    before: str
    after: str


def origin_of(pose: Pose) -> str:
    """Return the attributes of an ``<origin>``."""
    def words(numbers: tuple[float, ...]) -> str:
        return ' '.join(f'{round(value, 9) + 0.0:.9g}' for value in numbers)

    return f'xyz="{words(pose.translation)}" rpy="{words(pose.as_rpy())}"'


def write_origin(path: Path, parent: str, child: str, pose: Pose) -> Change:
    """
    Replace the origin of the joint between two links, and keep a copy of the file.

    :raises Cannot: the file or the joint does not exist, there are several such joints, the joint
        moves, or xacro or an entity provides the origin.
    """
    with cannot_be('read', path):
        data = path.read_bytes()
    if b'\0' in data:
        raise Cannot(f'{path} is not UTF-8: convert it first (iconv -f UTF-16 -t UTF-8)')
    joint = _joint_of(path, data, parent, child)
    begin, end, indent = _place_of(path, data, joint, pose)
    before = data[begin:end]
    if b'${' in before or b'$(' in before:
        raise Cannot(f'{path}, line {_line(data, begin)}: xacro computes this origin; edit it '
                     f'by hand: {origin_of(pose)}')
    after = _replaced(before, pose) if before else (
        indent + f'<origin {origin_of(pose)}/>'.encode())
    backup = _free_name(path)
    with cannot_be('written', path):
        write_whole(backup, [data])
        write_whole(path, [data[:begin] + after + data[end:]])
    return Change(path, backup, _line(data, begin), before.decode(errors='replace').strip(),
                  after.decode(errors='replace').strip())


class _Joint:
    """A joint while its element is read, with the byte offsets of its parts."""

    def __init__(self, joint_type: str, begin: int) -> None:
        self.joint_type, self.begin = joint_type, begin
        self.origins: list[int] = []
        # The first element of xacro in it, and the first origin inside another element.
        self.xacro: int | None = None
        self.inner_origin: int | None = None
        self.links: dict[str, str] = {}

    @property
    def doubt(self) -> int | None:
        """Return the place of an element that may provide the origin, or another one."""
        if len(self.origins) > 1:
            return self.origins[1]
        return self.inner_origin if self.origins or self.inner_origin else self.xacro


def _joint_of(path: Path, data: bytes, parent: str, child: str) -> _Joint:
    """Return the fixed joint between two links."""
    try:
        joints = [joint for joint in _joints(data)
                  if joint.links == {'parent': parent, 'child': child}]
    except expat.ExpatError as error:
        raise Cannot(f'{path} is not a URDF: {error}') from error
    if not joints:
        raise Cannot(f'{path} has no joint with the parent {parent} and the child {child}, the '
                     'calibrated edge: change the origin in the file that defines this edge')
    if len(joints) > 1:
        lines = ', '.join(str(_line(data, joint.begin)) for joint in joints)
        raise Cannot(f'{path} has several joints between {parent} and {child}, in the lines '
                     f'{lines}: edit the one that applies by hand')
    if joints[0].joint_type != 'fixed':
        raise Cannot(f'{path}: the joint between {parent} and {child} is of the type '
                     f'{joints[0].joint_type!r}, not fixed')
    return joints[0]


def _joints(data: bytes) -> list[_Joint]:
    """
    Return all joints of a description, also those in conditions and macros of xacro.

    :raises expat.ExpatError: it is not XML.
    """
    parser, depth = expat.ParserCreate(), list[str]()
    found, reading = list[_Joint](), list[_Joint]()

    def start(tag: str, attributes: dict[str, str]) -> None:
        if tag == 'joint' and _are_outside_elements(depth):
            reading[:] = [_Joint(attributes.get('type', ''), parser.CurrentByteIndex)]
        elif reading and depth[-1] == 'joint':
            if tag == 'origin':
                reading[0].origins.append(parser.CurrentByteIndex)
            elif tag in ('parent', 'child'):
                reading[0].links[tag] = attributes.get('link', '')
            elif tag.startswith('xacro:') and reading[0].xacro is None:
                reading[0].xacro = parser.CurrentByteIndex
        elif reading and tag == 'origin':
            reading[0].inner_origin = parser.CurrentByteIndex
        depth.append(tag)

    def end(_: str) -> None:
        if depth.pop() == 'joint' and reading and _are_outside_elements(depth):
            found.append(reading.pop())

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(data, True)
    return found


def _are_outside_elements(depth: list[str]) -> bool:
    """Return whether a joint may be inside these elements, such as <robot> and <xacro:if>."""
    return depth[:1] == ['robot'] and all(tag.startswith('xacro:') for tag in depth[1:])


def _place_of(path: Path, data: bytes, joint: _Joint, pose: Pose) -> tuple[int, int, bytes]:
    """Return where an origin begins and ends, and the space to write before a new one."""
    if joint.doubt is not None:
        raise Cannot(f'{path}, line {_line(data, joint.doubt)}: this joint may have another '
                     f'origin, or get it from xacro; edit it by hand: {origin_of(pose)}')
    begin = joint.origins[0] if joint.origins else joint.begin
    match = re.compile(rb'<' + _TAG).match(data, begin)
    if match is None:
        raise Cannot(f'{path}, line {_line(data, begin)}: an entity contains this origin; edit it '
                     f'by hand: {origin_of(pose)}')
    if joint.origins:
        return begin, match.end(), b''
    space = re.match(rb'\s*', data[match.end():])
    return match.end(), match.end(), space.group() if space else b''


def _replaced(tag: bytes, pose: Pose) -> bytes:
    """Return a tag with new values of its attributes; its other text is unchanged."""
    values = {name.encode(): value.encode() for name, value in re.findall(
        r'(\w+)="([^"]*)"', origin_of(pose))}

    def replaced(attribute: re.Match[bytes]) -> bytes:
        name, equals, _ = attribute.groups()
        value = values.pop(name, None)
        return attribute.group() if value is None else name + equals + b'"' + value + b'"'

    tag = _ATTRIBUTE.sub(replaced, tag)
    new = b''.join(b' ' + name + b'="' + value + b'"' for name, value in values.items())
    return tag.replace(b'<origin', b'<origin' + new, 1)


def _line(data: bytes, place: int) -> int:
    return data.count(b'\n', 0, place) + 1


def _free_name(path: Path) -> Path:
    """Return a name for the backup that no file has yet."""
    names = [path.with_name(f'{path.name}.bak'),
             *(path.with_name(f'{path.name}.bak{number}') for number in range(2, 1000))]
    return next(name for name in names if not name.exists())
