# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The content of a buffer as text: pure functions of ``Queries.edges()``."""

from collections.abc import Collection, Iterable
import re

from tf_tree_py.core.stamp import as_seconds
from tf_tree_py.core.tree.outline import EdgeInfo

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


def as_string(edges: Iterable[EdgeInfo]) -> str:
    """Return tf2's ``all_frames_as_string``: one line for every frame with a parent."""
    return ''.join(f'Frame {edge.child} exists with parent {edge.parent}.\n' for edge in edges)


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
