# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The frames of a buffer as a graph, and as text for other programs to draw."""

import json

import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.reports.frame_graph import as_dot, as_mermaid, frame_graph, RefusedEdge

SECOND = 10**9
REFUSED = RefusedEdge('base', 'map', ('/calibration',), 3)


@pytest.fixture
def tree():
    """Return map -> odom -> base -> lidar and mars -> rover: odom has ended, lidar is static."""
    buffer = BufferCore()
    for tick in range(100):
        stamp = SECOND + tick * SECOND // 10
        buffer.insert('odom', 'base', stamp, Pose(x=tick), authority='/wheels')
        buffer.insert('mars', 'rover', stamp, Pose(x=tick))
        if tick < 50:
            buffer.insert('map', 'odom', stamp, Pose(x=tick), authority='/amcl')
    buffer.insert('base', 'lidar', 0, Pose(), static=True)
    return buffer


def test_roots_stale_edges_and_refused_loops_are_told_in_words(tree):
    graph = frame_graph(tree, 11 * SECOND, [REFUSED])
    assert graph.roots == ('odom', 'map', 'mars')[1:]
    assert {edge.info.child for edge in graph.edges if edge.stale} == {'odom'}
    assert graph.remarks == [
        '2 trees that are not connected, below map, mars',
        'base -> map would close a loop and is refused; from /calibration',
        'map -> odom is stale: silent for 5.100 s']


def test_time_is_that_of_the_stamps_where_the_clock_is_another(tree):
    ages = {edge.info.child: edge.age for edge in frame_graph(tree, 10**18).edges}
    assert ages == {'base': 0, 'rover': 0, 'odom': 5 * SECOND, 'lidar': None}
    all_silent = frame_graph(tree, 35 * SECOND)
    assert sum(edge.stale for edge in all_silent.edges) == 3


def test_healthy_tree_has_nothing_to_tell():
    buffer = BufferCore()
    buffer.insert('map', 'base', SECOND, Pose())
    graph = frame_graph(buffer, SECOND)
    assert graph.remarks == []
    assert 'separate tree' not in as_dot(graph)
    assert graph.as_dict().keys() == frame_graph(BufferCore()).as_dict().keys()


def test_texts_hold_every_frame_and_what_is_wrong(tree):
    graph = frame_graph(tree, 11 * SECOND, [REFUSED])
    dot, mermaid = as_dot(graph), as_mermaid(graph)
    for text in (dot, mermaid):
        assert all(frame in text for frame in graph.frames)
        assert 'stale for 5.100 s' in text and 'refused: a loop' in text
        assert text.count('a separate tree') == 2
    json.dumps(graph.as_dict(), allow_nan=False)


@pytest.mark.parametrize('name', ['"; evil', 'a\\', '<b>', 'line\nend', 'x' * 900, 'ü/λ'])
def test_names_of_strangers_break_no_text(name):
    buffer = BufferCore()
    buffer.insert(name, 'base', SECOND, Pose(), authority=name)
    graph = frame_graph(buffer, SECOND, [RefusedEdge('base', name, (name,), 1)])
    for line in as_dot(graph).splitlines():
        assert line.replace('\\\\', '').replace('\\"', '').count('"') % 2 == 0
    for line in as_mermaid(graph).splitlines():
        assert line.count('"') in (0, 2)
        assert '<b>' not in line and len(line) < 400
