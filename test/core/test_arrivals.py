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

"""What a meter counts between two reports."""

import threading

from hand_clock import HandClock
import pytest
from tf_tree_py import BufferCore, Pose
from tf_tree_py.core import Kind, Sample
from tf_tree_py.core.arrivals.meters import Meter
from tf_tree_py.core.arrivals.sample import Batch
from tf_tree_py.core.edges.packed import pack_pose

SECOND = 10**9


@pytest.fixture
def clock():
    return HandClock(100 * SECOND)


@pytest.fixture
def meter(clock):
    return Meter(clock)


@pytest.fixture
def buffer(meter):
    buffer = BufferCore()
    buffer.observers.add(meter)
    return buffer


def test_count_and_delays_of_each_edge(buffer, meter, clock):
    for late in (3, 1, -2):
        buffer.insert('map', 'odom', clock.now - late * SECOND, Pose())
    buffer.insert('odom', 'base', clock.now, Pose())
    taken = meter.take()
    assert list(taken) == [('map', 'odom'), ('odom', 'base')]
    odom = taken['map', 'odom']
    assert (odom.count, odom.timed) == (3, 3)
    assert odom.longest_delay == 3 * SECOND
    assert odom.shortest_delay == -2 * SECOND
    assert odom.mean_delay == pytest.approx(2 * SECOND / 3)
    assert taken['odom', 'base'].mean_delay == 0


def test_taking_begins_anew(buffer, meter, clock):
    buffer.insert('map', 'odom', clock.now, Pose())
    meter.take()
    assert meter.take() == {}


@pytest.mark.parametrize('count', [1, 40])
def test_whole_messages_are_counted(buffer, meter, clock, count):
    edges = [('map', f'child{number}') for number in range(count)]
    poses = [pack_pose(*Pose())] * count
    for _ in range(3):
        buffer.insert_batch(Batch(edges, [clock.now - 5] * count, poses))
    taken = meter.take()
    assert list(taken) == edges
    assert {(arrivals.count, arrivals.mean_delay) for arrivals in taken.values()} == {(3, 5.0)}


def test_what_is_refused_is_counted_with_its_reason(buffer, meter, clock):
    buffer.insert('/map', '/odom', clock.now, Pose())
    for _ in range(2):
        buffer.insert('map', 'odom', clock.now - 11 * SECOND, Pose())
    buffer.insert('odom', 'map', clock.now, Pose())
    taken = meter.take()
    assert taken['map', 'odom'].count == 3
    assert taken['map', 'odom'].incidents == {Kind.OLD_DATA: 2}
    assert taken['odom', 'map'].incidents == {Kind.LOOP: 1}


def test_refused_future_arrives_too(meter, clock):
    buffer = BufferCore(now=clock, max_future=SECOND)
    buffer.observers.add(meter)
    sample = Sample('map', 'odom', clock.now + 60 * SECOND, tuple(Pose()))
    buffer.insert_many([sample])
    buffer.insert_batch(
        Batch([sample[:2]] * 10, [sample.stamp] * 10, [pack_pose(*sample.pose)] * 10))
    (arrivals,) = meter.take().values()
    assert arrivals.count == 11
    assert arrivals.incidents == {Kind.FAR_FUTURE: 11}
    assert arrivals.shortest_delay == -60 * SECOND


def test_static_edges_do_not_arrive(buffer, meter):
    buffer.insert('base', 'camera', 0, Pose(), static=True)
    assert meter.take() == {}


def test_clock_that_has_not_begun_gives_no_delays(buffer, meter, clock):
    clock.now = 0
    buffer.insert('map', 'odom', 5 * SECOND, Pose())
    (arrivals,) = meter.take().values()
    assert (arrivals.count, arrivals.timed, arrivals.mean_delay) == (1, 0, 0.0)


def test_meter_that_was_let_go_hears_no_more(buffer, meter, clock):
    other = Meter(clock)
    buffer.observers.add(other)
    buffer.observers.remove(meter)
    buffer.observers.remove(meter)
    buffer.insert('map', 'odom', clock.now, Pose())
    assert meter.take() == {}
    assert other.take()


def test_made_up_frames_do_not_eat_the_memory(buffer, meter, clock):
    for number in range(5_000):
        buffer.insert('map', f'child{number}', clock.now, Pose())
    taken = meter.take()
    assert len(taken) <= 1_001
    assert sum(arrivals.count for arrivals in taken.values()) == 5_000


def test_threads_lose_no_count(buffer, meter, clock):
    def insert(name):
        for number in range(500):
            buffer.insert('map', name, clock.now + number, Pose())

    threads = [threading.Thread(target=insert, args=(name,)) for name in 'aabb']
    for thread in threads:
        thread.start()
    count = 0
    while any(thread.is_alive() for thread in threads):
        count += sum(arrivals.count for arrivals in meter.take().values())
    count += sum(arrivals.count for arrivals in meter.take().values())
    assert count == 2_000
