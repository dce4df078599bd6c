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

"""Counts of two times, or two buffers, are those of both together, whichever comes first."""

from hypothesis import given, strategies as st
from tf_tree_py.core import BufferCore, Incident, Kind, Pose, Statistics
from tf_tree_py.core.arrivals.incidents import grouped, IncidentGroup
from tf_tree_py.core.arrivals.merging import merged
from tf_tree_py.core.arrivals.meters import Arrivals, Meter

SECOND = 10**9
COUNTS = st.integers(0, 5)
STAMPS = st.integers(-2**63, 2**63 - 1)
KINDS = st.sampled_from(Kind)


@st.composite
def arrivals(draw):
    made = Arrivals(count=draw(COUNTS))
    for delay in draw(st.lists(st.integers(-10**12, 10**12), max_size=5)):
        made.add_delay(delay)
    made.incidents.update(draw(st.lists(KINDS, max_size=4)))
    return made


@st.composite
def statistics(draw):
    made = Statistics(accepted=draw(COUNTS), frames=draw(COUNTS))
    for kind in draw(st.lists(KINDS, max_size=5)):
        made.incidents[kind] += 1
    return made


@st.composite
def incidents(draw):
    return Incident(draw(KINDS), draw(st.sampled_from('ab')), draw(st.sampled_from('cd')),
                    draw(STAMPS), 'me', 'for a test')


GROUPS = st.builds(IncidentGroup, COUNTS, STAMPS, STAMPS)
VALUES = [arrivals(), statistics(), GROUPS, COUNTS]
THREE = st.one_of([st.tuples(value, value, value) for value in VALUES])


@given(THREE)
def test_neither_the_order_nor_the_grouping_of_a_sum_matters(three):
    a, b, c = three
    assert a + b == b + a
    assert (a + b) + c == a + (b + c)


@given(st.one_of(arrivals(), statistics()))
def test_nothing_added_changes_nothing(value):
    assert value + type(value)() == value


@given(arrivals(), arrivals())
def test_a_sum_leaves_its_parts_alone(a, b):
    before = a.count, dict(a.incidents), b.count, dict(b.incidents)
    a_and_b = a + b
    a_and_b.incidents[Kind.LOOP] += 1
    a_and_b.add_delay(3)
    assert (a.count, dict(a.incidents), b.count, dict(b.incidents)) == before


@given(st.lists(st.tuples(st.booleans(), st.integers(-SECOND, SECOND)), max_size=12))
def test_delays_of_two_halves_are_those_of_the_whole(delays):
    whole, halves = Arrivals(), (Arrivals(), Arrivals())
    for half, delay in delays:
        whole.add_delay(delay)
        halves[half].add_delay(delay)
    assert halves[0] + halves[1] == whole


@given(st.lists(incidents(), max_size=12), st.integers(0, 12))
def test_groups_of_two_halves_are_those_of_the_whole(happened, middle):
    halves = grouped(happened[:middle]), grouped(happened[middle:])
    assert merged(*halves) == merged(*reversed(halves)) == grouped(happened)


def test_group_tells_how_many_and_from_when_to_when():
    happened = [Incident(Kind.LOOP, 'map', 'odom', stamp, 'me', '') for stamp in (5, 3, 9)]
    assert grouped(happened) == {(Kind.LOOP, 'map', 'odom'): IncidentGroup(3, 3, 9)}


def test_merged_tables_leave_theirs_alone():
    first, second = {('a', 'b'): Arrivals(1)}, {('a', 'b'): Arrivals(2), ('b', 'c'): Arrivals(4)}
    assert merged(first, second) == {('a', 'b'): Arrivals(3), ('b', 'c'): Arrivals(4)}
    assert first == {('a', 'b'): Arrivals(1)}
    assert merged() == {}


def test_two_takes_of_a_meter_make_one():
    now = 100 * SECOND
    meter, both = Meter(lambda: now), Meter(lambda: now)
    taken = []
    for late in (1, 40, 3, 2):
        for watching in meter, both:
            watching.arrived([('map', 'odom')], [now - late * SECOND])
            watching.saw_incidents([Incident(Kind.OLD_DATA, 'map', 'odom', now, 'me', '')])
        taken.append(meter.take())
    assert merged(*taken) == both.take()


def test_statistics_of_two_buffers_are_added():
    first, second = BufferCore(), BufferCore()
    for buffer in first, second:
        buffer.insert('map', 'odom', 1, Pose())
    second.insert('odom', 'map', 2, Pose(), strict=False)
    together = first.statistics() + second.statistics()
    assert (together.accepted, together.refused, together.frames) == (2, 1, 2)
    assert together.incidents[Kind.LOOP] == 1
    assert str(together) == '2 accepted, 1 refused, 2 frames; would close a loop: 1'
