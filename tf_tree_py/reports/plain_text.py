# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Tables, poses and the content of a buffer as plain text.

These are pure functions; those of a buffer take ``Queries.edges()``.
"""

from collections.abc import Callable, Collection, Container, Iterable, Mapping, Sequence
from math import degrees
import re

from tf_tree_py.core.geometry.pose import Pose
from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.core.tree.edge_info import EdgeInfo


def as_lines(rows: Sequence[Sequence[str]], right: Container[int],
             rule: bool = False) -> list[str]:
    """
    Return rows as lines with aligned columns.

    :param rows: the headings first; all of one length.
    :param right: the indexes of the columns that are aligned right, such as those of numbers.
    :param rule: whether to write a line of dashes below the headings.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ['  '.join(
        cell.rjust(width) if number in right else cell.ljust(width)
        for number, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip()
        for row in rows]
    if rule:
        lines.insert(1, '  '.join('-' * width for width in widths))
    return lines


# --- poses

def as_line(pose: Pose) -> str:
    """Return translation and roll, pitch, yaw, in columns of constant width."""
    return f'{_translation(pose)}  {_rpy(pose)}'


def _as_quaternion_line(pose: Pose) -> str:
    """Return translation and quaternion x y z w, in columns of constant width."""
    return f'{_translation(pose)}  q {" ".join(f"{part:9.6f}" for part in pose.rotation)}'


def _as_matrix_lines(pose: Pose) -> str:
    """Return the 4x4 matrix, one row on each line."""
    return '\n'.join(' '.join(f'{_whole(number, 6):10.6f}' for number in row)
                     for row in pose.as_matrix().tolist())


def _as_all(pose: Pose) -> str:
    """Return the pose in all notations."""
    radians = ' '.join(f'{_whole(angle, 4):7.4f}' for angle in pose.as_rpy())
    return '\n'.join([_as_quaternion_line(pose), f'{_rpy(pose)} ({radians} rad)',
                      _as_matrix_lines(pose)])


FORMS: Mapping[str, Callable[[Pose], str]] = {
    'rpy': as_line, 'quaternion': _as_quaternion_line, 'matrix': _as_matrix_lines, 'all': _as_all}
"""The notations of a pose, by name."""


def _translation(pose: Pose) -> str:
    return f'xyz {pose.x:7.3f} {pose.y:7.3f} {pose.z:7.3f} m'


def _rpy(pose: Pose) -> str:
    roll, pitch, yaw = (_whole(degrees(angle), 2) for angle in pose.as_rpy())
    return f'rpy {roll:7.2f} {pitch:7.2f} {yaw:7.2f} deg'


def _whole(number: float, digits: int) -> float:
    # Adding 0.0 turns -0.0 into 0.0.
    return round(number, digits) + 0.0


# --- buffers

# tf2 divides by the stored span, but never by less than this many seconds.
_SHORTEST_SPAN_S = 1e-4


# Names that YAML reads as strings without quotes. They begin with no indicator of YAML and contain
# neither ': ' nor ' #'. Numbers and dates begin with a digit, so a name that begins with one needs
# a letter that occurs in neither, such as 'm'.
_PLAIN = re.compile(
    r'(?:[^\W\d]|/|[0-9](?=[^:]*[g-np-su-wyz/]))'
    r'(?:[\w/.$%&*@!?+=~^|<>(){}\[\],;\'"`#-]|:(?=[\w/:])|[ ](?=[\w/]))*', re.IGNORECASE)
# Words that YAML 1.1 reads as true, false or nothing.
_WORDS = frozenset(['y', 'n', 'yes', 'no', 'on', 'off', 'true', 'false', 'null'])
# YAML requires '? ' before a key of more than 1024 characters, quotes included.
_LONGEST_KEY = 1000


def as_yaml(edges: Iterable[EdgeInfo], frames: Collection[str]) -> str:
    """
    Return tf2's ``all_frames_as_yaml``, byte for byte; the ``tf2_frames`` service's answer.

    A name that YAML would read back as something else is quoted here, but not by tf2.
    Static edges have the rate 10000.000, as in tf2: one sample in no time.

    :param frames: the known frames, including those of edges without data.
    """
    blocks = [
        f'{_yaml_key(edge.child)}: \n'
        f'  parent: {_yaml_text(edge.parent)}\n'
        f'  broadcaster: {_yaml_text(edge.authority)}\n'
        f'  rate: {rate_hz(edge):.3f}\n'
        f'  most_recent_transform: {as_seconds(edge.latest):.6f}\n'
        f'  oldest_transform: {as_seconds(edge.oldest):.6f}\n'
        f'  buffer_length: {as_seconds(edge.span):.3f}\n'
        for edge in edges
    ]
    return ''.join(blocks) if frames else '[]'


def _yaml_key(name: str) -> str:
    """Return a name as a key of YAML, without the colon."""
    key = name
    if not _PLAIN.fullmatch(name) or name.lower() in _WORDS:
        key = _yaml_text(name)
    return key if len(key) <= _LONGEST_KEY else f'? {key}\n'


def _yaml_text(text: str) -> str:
    """Return a YAML string: in single quotes, or in double ones if characters are escaped."""
    if text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return '"' + ''.join(_yaml_letter(letter) for letter in text) + '"'


def _yaml_letter(letter: str) -> str:
    return letter if letter.isprintable() and letter not in '"\\' else f'\\U{ord(letter):08x}'


def as_string(children: Iterable[str], edges: Iterable[EdgeInfo]) -> str:
    """
    Return tf2's ``all_frames_as_string``: one line for every frame that was ever a child.

    :param children: these frames; those without an edge have no data, for example after a clear.
    """
    parents = {edge.child: edge.parent for edge in edges}
    return ''.join(f'Frame {child} exists with parent {parents.get(child, "NO_PARENT")}.\n'
                   for child in children)


def as_dot(edges: Iterable[EdgeInfo]) -> str:
    """Return the tree as a graph in DOT, an arrow from each parent to its child."""
    lines = [
        f'  {quoted(edge.parent)} -> {quoted(edge.child)} [label={quoted(_dot_label(edge))}];\n'
        for edge in edges
    ]
    return 'digraph G {\n' + (''.join(lines) or '  "no tf data received";\n') + '}\n'


def _dot_label(edge: EdgeInfo) -> str:
    if edge.static:
        return f'Broadcaster: {edge.authority}\nstatic'
    return (f'Broadcaster: {edge.authority}\nAverage rate: {rate_hz(edge):.3f} Hz\n'
            f'Most recent transform: {as_seconds(edge.latest):.6f}\n'
            f'Buffer length: {as_seconds(edge.span):.3f} s')


def quoted(text: str) -> str:
    """Return a quoted ID of DOT, with backslashes, quotes and line ends escaped."""
    escaped = text.replace('\\', '\\\\').replace('"', '\\"').replace('\n', '\\n')
    return f'"{escaped}"'


def rate_hz(edge: EdgeInfo) -> float:
    """Return the samples per second of an edge, by tf2's formula."""
    return edge.samples / max(as_seconds(edge.span), _SHORTEST_SPAN_S)
