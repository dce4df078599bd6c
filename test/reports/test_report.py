# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

from hypothesis import given, strategies as st
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.reports import plain_text

SECOND = 1_000_000_000


def buffer_of_a_robot():
    buffer = BufferCore()
    for tick in range(5):
        buffer.insert('odom', 'base', 10 * SECOND + tick * SECOND // 4, Pose(), authority='driver')
    buffer.insert('base', 'camera', 77, Pose(), authority='urdf', static=True)
    return buffer


def as_yaml(buffer):
    return plain_text.as_yaml(buffer.edges(), buffer.frames())


def test_yaml_is_that_of_tf2():
    assert as_yaml(buffer_of_a_robot()) == (
        'base: \n'
        "  parent: 'odom'\n"
        "  broadcaster: 'driver'\n"
        '  rate: 5.000\n'
        '  most_recent_transform: 11.000000\n'
        '  oldest_transform: 10.000000\n'
        '  buffer_length: 1.000\n'
        'camera: \n'
        "  parent: 'base'\n"
        "  broadcaster: 'urdf'\n"
        '  rate: 10000.000\n'
        '  most_recent_transform: 0.000000\n'
        '  oldest_transform: 0.000000\n'
        '  buffer_length: 0.000\n')


def test_yaml_of_nothing_is_an_empty_list():
    assert plain_text.as_yaml([], []) == '[]'
    assert as_yaml(BufferCore()) == '[]'


def test_string_is_a_line_for_each_frame_with_a_parent():
    assert plain_text.as_string(['base', 'camera'], buffer_of_a_robot().edges()) == (
        'Frame base exists with parent odom.\n'
        'Frame camera exists with parent base.\n')
    assert plain_text.as_string([], []) == ''


def test_cleared_edge_has_no_parent():
    buffer = buffer_of_a_robot()
    buffer.clear()
    assert plain_text.as_string(['base', 'camera'], buffer.edges()) == (
        'Frame base exists with parent NO_PARENT.\n'
        'Frame camera exists with parent base.\n')


# --- odd names in YAML

def read_back(*edges):
    """Return the edges as a YAML parser reads them: {child: (parent, broadcaster)}."""
    yaml = pytest.importorskip('yaml')
    buffer = BufferCore()
    for parent, child, authority in edges:
        assert buffer.insert(parent, child, 1, Pose(), authority=authority) == []
    read = yaml.safe_load(as_yaml(buffer))
    return {child: (said['parent'], said['broadcaster']) for child, said in read.items()}


# YAML parses these names in the form in which tf2 writes them.
ORDINARY = [
    'base_link', 'robot1/base_link', 'camera-2.left', '3d_camera', 'my frame', 'tf2::map',
    'caméra', 'Base', 'frame(1)', 'a{b}', 'leg[0]', 'odom@t=1', '_hidden', 'on_off', 'a#b',
    '10m_mast', '2nd/arm', 'null_space', 'ns:frame']


def test_ordinary_name_is_written_as_tf2_does_and_read_back():
    for name in ORDINARY:
        buffer = BufferCore()
        buffer.insert('a/b', name, 1, Pose(), static=True, authority='me')
        assert as_yaml(buffer).startswith(
            f"{name}: \n  parent: 'a/b'\n  broadcaster: 'me'\n  rate: ")
        assert read_back(('a/b', name, 'me')) == {name: ('a/b', 'me')}


ODD = [
    'a: b', '{a}', '[a', 'a #b', '#', '- a', '-', '?', ': ', 'a:', 'a: ', ' a', 'a ', "it's",
    '"a"', "'", '\\', 'a\nb: c', '\n', '\t', 'true', 'No', 'Y', 'null', '~', '1', '1.5',
    '1e3', '0x1f', '0b11', '1_000', '1:30', '12:30:45', '2001-12-14', '.inf', '.5', '<<', '=',
    '!a', '&a', '*a', '%a', '@a', '`a', '|', '>', ',', '---', '...', '\x85', '\u2028', '\ufeff',
    '\x7f', '\x1b[31m', '🤖', '\U0010ffff', 'x' * 1000, 'x' * 1001, 'x' * 1024, "'" * 1024,
    '\n' * 1024, '2001-12-14 12:30:45', '2001-12-14t21:59:43.10-05:00', '1 a', 'a b', 'a  b',
    '123 456']


def test_odd_name_is_read_back_from_yaml():
    for name in ODD:
        edges = [('map', name, name), (name, 'tool', 'me'), ('map', 'other', 'me')]
        assert read_back(*edges) == {child: tuple(rest) for *rest, child in (
            ('map', name, name), (name, 'me', 'tool'), ('map', 'me', 'other'))}, repr(name)


@given(st.lists(st.text(min_size=1) | st.sampled_from(ORDINARY + ODD) | st.text(
    ':#{}[]-?!&*%@`\'" \\\n\t01eE.xy/_~=<>|,', min_size=1), min_size=1, unique=True))
def test_whatever_is_let_in_is_read_back_from_yaml(names):
    yaml = pytest.importorskip('yaml')
    buffer = BufferCore()
    for name in names:
        buffer.insert('map', name, 1, Pose(), authority=name)
        buffer.insert(name, f'under {name}', 1, Pose())
    edges = buffer.edges()
    read = dict(yaml.safe_load(as_yaml(buffer)))
    assert [(child, said['parent'], said['broadcaster']) for child, said in read.items()] == [
        (edge.child, edge.parent, edge.authority) for edge in edges]
