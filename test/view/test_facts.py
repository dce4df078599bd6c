# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The texts beside the picture: the list, the facts, the trail, the colours."""

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.view.model.colours import greys, of_edges
from tf_tree_py.view.model.facts import biggest_root, facts, rows
from tf_tree_py.view.model.moment import live_moment, moment_at, trail
from tf_tree_py.view.panels import markup

SECOND = 1_000_000_000


@pytest.fixture
def buffer():
    buffer = BufferCore()
    for tenth in range(101):
        buffer.insert('map', 'odom', tenth * SECOND // 10 + SECOND, Pose(),
                      authority='/localizer')
        buffer.insert('odom', 'base', tenth * SECOND // 10 + SECOND, Pose(x=tenth / 10),
                      authority='/wheels')
    buffer.insert('base', 'Camera', 0, Pose(z=1.0), static=True)
    buffer.insert('base', 'lidar', 0, Pose(z=2.0), static=True)
    buffer.insert('other', 'thing', 0, Pose(), static=True)
    return buffer


def listed(edges, search=''):
    return [f'{row.lead}{row.frame}' for row in rows(edges, search)]


def test_list_is_the_tree(buffer):
    assert listed(buffer.edges()) == [
        'map', '└─ odom', '   └─ base', '      ├─ Camera', '      └─ lidar',
        'other', '└─ thing']


def test_search_leaves_what_it_finds_and_what_that_hangs_on(buffer):
    assert listed(buffer.edges(), ' cam ') == ['map', '└─ odom', '   └─ base', '      └─ Camera']
    assert listed(buffer.edges(), 'nowhere') == []


def test_list_of_a_long_chain_needs_no_recursion():
    buffer = BufferCore()
    for number in range(3000):
        buffer.insert(f'f{number}', f'f{number + 1}', 0, Pose(), static=True)
    assert len(rows(buffer.edges())) == 3001


def test_page_begins_with_the_root_of_most_frames(buffer):
    assert biggest_root(buffer.edges()) == 'map'
    assert biggest_root([]) is None


def test_facts_of_a_moving_frame(buffer):
    told = dict(facts(buffer, buffer.edges(), live_moment(buffer, 'map', 12 * SECOND), 'base'))
    assert told['position'] == '10.0000, 0.0000, 0.0000 m'
    assert (told['parent'], told['publisher'], told['rate']) == ('odom', '/wheels', '10.0 Hz')
    assert told['age'].startswith('1.0')
    assert {'odom → base', 'map → odom'} <= told.keys()


def test_facts_are_those_of_an_explanation(buffer):
    moment = moment_at(buffer, 'map', 5_250_000_000)
    told = dict(facts(buffer, buffer.edges(), moment, 'Camera'))
    assert told['base → Camera'] == 'static, from default_authority'
    assert told['odom → base'] == ('10.0 Hz, newest 5.750 s after this, -50.0 +50.0 ms, '
                                   '10.0 cm 0.0° apart, from /wheels')
    assert 'sigma' not in told
    buffer.insert('base', 'Camera', 0, Pose(z=1.0), static=True,
                  covariance=np.diag([1e-4, 0.0, 0.0, 0.0, 0.0, 0.0]))
    told = dict(facts(buffer, buffer.edges(), moment, 'Camera'))
    assert told['sigma'] == '1 cm, 0°'
    assert told['share of base -> Camera'] == '100% of position, 0% of rotation'


def test_facts_of_a_root_a_static_frame_and_one_of_another_tree(buffer):
    moment = moment_at(buffer, 'map', 5 * SECOND)
    edges = buffer.edges()
    assert dict(facts(buffer, edges, moment, 'map'))['parent'] == 'none: it is a root'
    assert dict(facts(buffer, edges, moment, 'lidar'))['kind'] == 'static'
    told = dict(facts(buffer, edges, moment, 'thing'))
    assert told['pose'] == "unknown in 'map' at this stamp" and 'thing' in told['why']
    assert 'why' in dict(facts(buffer, edges, moment, 'forgotten'))


def test_trail_is_where_the_frame_was_without_a_bridge_over_a_gap(buffer):
    pieces = trail(buffer, 'map', 'base', SECOND, 11 * SECOND)
    assert pieces.shape == (399, 2, 3)
    np.testing.assert_allclose([pieces[0, 0, 0], pieces[-1, 1, 0]], [0.0, 10.0])
    with_gap = trail(buffer, 'map', 'base', SECOND, 21 * SECOND)
    assert 150 < len(with_gap) < 210 and np.isfinite(with_gap).all()
    assert len(trail(buffer, 'map', 'thing', SECOND, 11 * SECOND)) == 0


def test_stale_lines_are_grey_and_pale_with_age(buffer):
    moment = live_moment(buffer, 'map', 20 * SECOND)
    line = of_edges(moment)[moment.place('base')]
    assert line[0] == line[1] == line[2]
    assert (np.diff(greys(np.array([2, 10, 30, 99]) * SECOND)[:, 0].astype(int)) >= 0).all()
    fresh = live_moment(buffer, 'map', 11 * SECOND)
    lines = of_edges(fresh)
    assert (lines[fresh.place('base')] != lines[fresh.place('lidar')]).any()


def test_names_of_strangers_are_text_and_not_html():
    assert '<b>' not in markup.table([('<b>', '<script>')])
    assert '<script' not in markup.status('<script>' * 9, '<script>')
