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

"""How the edges of a tree are, as data, as text and as JSON."""

from collections import Counter
import json

from hypothesis import given, strategies as st
import pytest
from tf_tree_py.core import BufferCore, Kind, Pose
from tf_tree_py.core.arrivals.meters import Arrivals, Meter
from tf_tree_py.core.telling.diagnosis import as_json, as_text, diagnose

SECOND = 10**9
NOW = 100 * SECOND


def robot():
    """Return a buffer in two pieces, and what arrived of its edges."""
    buffer, meter = BufferCore(), Meter(lambda: NOW)
    buffer.insert('base', 'camera', 0, Pose(), authority='urdf', static=True)

    def send(parent, child, stamp, authority='default_authority'):
        meter.arrived([(parent, child)], [stamp])
        meter.saw_incidents(
            buffer.insert(parent, child, stamp, Pose(), authority=authority, strict=False))

    for late in (3, 2, 1):
        send('odom', 'base', NOW - late * SECOND // 2, '/wheels')
    send('odom', 'base', NOW - 60 * SECOND)
    send('camera', 'odom', NOW)
    send('map', 'pallet', NOW)
    return buffer, meter.take()


def test_edges_roots_and_frames():
    found = diagnose(robot()[0])
    assert found.frames == ('camera', 'base', 'odom', 'pallet', 'map')
    assert found.roots == ('odom', 'map')
    assert [edge.info.child for edge in found.edges] == ['camera', 'base', 'pallet']
    assert [edge.rate_hz for edge in found.edges] == [0.0, 2.0, 0.0]
    assert found.absent == ()


def test_arrivals_stand_beside_what_is_stored():
    buffer, arrived = robot()
    found = diagnose(buffer, arrived)
    _, base, _ = found.edges
    assert base.arrivals is arrived['odom', 'base']
    assert (base.arrivals.count, base.arrivals.refused) == (4, 1)
    (absent,) = found.absent
    assert absent.info[:2] == ('camera', 'odom')
    assert absent.info.samples == 0
    assert absent.arrivals.incidents == {Kind.LOOP: 1}


def test_stamps_ahead_of_the_clock():
    arrivals = Arrivals()
    for delay in (-7, 3):
        arrivals.add_delay(delay)
    buffer = BufferCore()
    buffer.insert('map', 'odom', 1, Pose())
    (edge,) = diagnose(buffer, {('map', 'odom'): arrivals}).edges
    assert edge.ahead == 7
    (edge,) = diagnose(buffer).edges
    assert edge.ahead == 0


def test_snapshot_is_diagnosed_as_its_buffer():
    buffer, arrived = robot()
    assert diagnose(buffer.snapshot(), arrived) == diagnose(buffer, arrived)


def test_text_has_a_line_for_each_edge():
    title, heads, rule, *lines = as_text(diagnose(*robot())).splitlines()
    assert title == '5 frames, 3 edges, roots: odom, map'
    assert heads.startswith('parent -> child')
    assert set(rule) == {'-', ' '}
    assert [line.split()[:4] for line in lines] == [
        ['base', '->', 'camera', 'urdf'], ['odom', '->', 'base', '/wheels'],
        ['map', '->', 'pallet', 'default_authority'], ['camera', '->', 'odom', '-']]
    assert '1 older than the buffer keeps' in lines[1]
    assert 'not in the tree' in lines[3]
    assert '1 would close a loop' in lines[3]


def test_text_of_nothing():
    assert as_text(diagnose(BufferCore())) == '0 frames, 0 edges, roots: none'


def test_what_has_no_names_is_called_others():
    arrived = {('', ''): Arrivals(3, incidents=Counter({Kind.MALFORMED: 3}))}
    (line,) = as_text(diagnose(BufferCore(), arrived)).splitlines()[3:]
    assert line.startswith('others ')
    assert line.endswith(' 3 malformed message')


def test_json_has_the_same_keys_always():
    said = json.loads(as_json(diagnose(*robot())))
    assert list(said) == ['frames', 'roots', 'edges', 'absent']
    keys = ['parent', 'child', 'authority', 'static', 'samples', 'oldest', 'latest', 'span',
            'rate_hz', 'arrived', 'delay', 'incidents']
    assert [list(edge) for edge in said['edges'] + said['absent']] == [keys] * 4
    camera, base, _ = said['edges']
    assert base == {
        'parent': 'odom', 'child': 'base', 'authority': '/wheels', 'static': False, 'samples': 3,
        'oldest': NOW - 3 * SECOND // 2, 'latest': NOW - SECOND // 2, 'span': SECOND,
        'rate_hz': 2.0, 'arrived': 4,
        'delay': {'mean': 15.75 * SECOND, 'shortest': SECOND // 2, 'longest': 60 * SECOND},
        'incidents': {'older than the buffer keeps': 1}}
    assert (camera['static'], camera['delay'], camera['incidents']) == (True, None, {})


def test_json_without_a_meter():
    (edge,) = json.loads(as_json(diagnose(buffer_of_one())))['edges']
    assert (edge['arrived'], edge['delay'], edge['incidents']) == (0, None, {})


def buffer_of_one():
    buffer = BufferCore()
    buffer.insert('map', 'odom', 1, Pose())
    return buffer


@given(st.lists(st.tuples(st.text(min_size=1, max_size=200), st.text(max_size=200)), max_size=6))
def test_whatever_the_names_text_keeps_a_line_for_each_edge(names):
    buffer = BufferCore()
    for child, authority in names:
        buffer.insert('root of all', child, 1, Pose(), authority=authority, strict=False)
    found = diagnose(buffer)
    assert len(as_text(found).splitlines()) == 1 + (2 + len(found.edges) if found.edges else 0)
    assert len(json.loads(as_json(found))['edges']) == len(found.edges)


@pytest.mark.parametrize('samples, rate', [(1, 0.0), (2, 1.0), (11, 10.0)])
def test_rate_counts_intervals(samples, rate):
    buffer = BufferCore()
    for number in range(samples):
        buffer.insert('map', 'odom', 1 + number * SECOND // max(samples - 1, 1), Pose())
    (edge,) = diagnose(buffer).edges
    assert edge.rate_hz == pytest.approx(rate)
