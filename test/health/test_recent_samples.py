# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A doctor's counts between two readings, of messages and of insertions by programs."""

import threading

from hand_clock import HandClock
import numpy as np
import pytest
from tf_tree_py import BufferCore, Pose
from tf_tree_py.core import Kind, Sample
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.messages.sample import Batch
from tf_tree_py.health.doctor import Doctor

SECOND = 10**9


@pytest.fixture
def clock():
    return HandClock(100 * SECOND)


@pytest.fixture
def doctor():
    return Doctor()


@pytest.fixture
def buffer(doctor, clock):
    buffer = BufferCore(now=clock)
    buffer.observers.add(doctor)
    return buffer


def test_count_and_delays_of_each_edge(buffer, doctor, clock):
    for late in (3, 1, -2):
        buffer.insert('map', 'odom', clock.now - late * SECOND, Pose())
    buffer.insert('odom', 'base', clock.now, Pose())
    taken = doctor.pop_recent()
    assert list(taken) == [('map', 'odom'), ('odom', 'base')]
    odom = taken['map', 'odom']
    assert (odom.count, odom.timed) == (3, 3)
    assert (odom.longest_delay, odom.shortest_delay) == (3 * SECOND, -2 * SECOND)
    assert odom.ahead == 2 * SECOND
    assert odom.mean_delay == pytest.approx(2 * SECOND / 3)
    assert taken['odom', 'base'].mean_delay == taken['odom', 'base'].ahead == 0


def test_taking_begins_anew_and_the_record_goes_on(buffer, doctor, clock):
    buffer.insert('map', 'odom', clock.now, Pose())
    doctor.pop_recent()
    assert doctor.pop_recent() == {}
    assert [one.count for one in doctor.signs()] == [1]


@pytest.mark.parametrize('count', [1, 40])
def test_whole_messages_are_counted(buffer, doctor, clock, count):
    edges = [('map', f'child{number}') for number in range(count)]
    poses = [pack_pose(*Pose())] * count
    for _ in range(3):
        buffer.insert_batch(Batch(edges, [clock.now - 5] * count, poses))
    taken = doctor.pop_recent()
    assert list(taken) == edges
    assert {(arrivals.count, arrivals.mean_delay) for arrivals in taken.values()} == {(3, 5.0)}


def test_message_that_was_announced_counts_once(buffer, doctor, clock):
    batch = Batch([('map', 'odom')], [clock.now], [pack_pose(*Pose())])
    buffer.insert_batch(batch, announced=True)
    assert doctor.pop_recent() == {}


def test_tracks_and_many_samples_count_one_by_one(buffer, doctor, clock):
    stamps = clock.now + np.arange(5)
    buffer.insert_track('map', 'odom', stamps, np.tile(Pose(), (5, 1)))
    buffer.insert_many([Sample('odom', 'base', clock.now + n, tuple(Pose())) for n in range(3)])
    assert [one.count for one in doctor.pop_recent().values()] == [5, 3]


def test_of_several_sources_the_one_that_the_edge_takes_counts(buffer, doctor, clock):
    for source in ('wheels', 'visual', 'visual'):
        clock.now += SECOND
        buffer.insert_from(source, 'odom', 'base', clock.now, Pose())
    assert doctor.pop_recent()['odom', 'base'].count == 1
    (sign,) = doctor.signs()
    assert sign.publishers == ('wheels',)


def test_what_is_refused_is_counted_with_its_reason(buffer, doctor, clock):
    buffer.insert('/map', '/odom', clock.now, Pose())
    for _ in range(2):
        buffer.insert('map', 'odom', clock.now - 11 * SECOND, Pose())
    buffer.insert('odom', 'map', clock.now, Pose())
    taken = doctor.pop_recent()
    assert (taken['map', 'odom'].count, taken['map', 'odom'].refused) == (3, 2)
    assert taken['map', 'odom'].incidents == {Kind.OLD_DATA: 2}
    assert taken['odom', 'map'].incidents == {Kind.LOOP: 1}


def test_refused_future_arrives_too(doctor, clock):
    buffer = BufferCore(now=clock, max_future=SECOND)
    buffer.observers.add(doctor)
    sample = Sample('map', 'odom', clock.now + 60 * SECOND, tuple(Pose()))
    buffer.insert_many([sample])
    buffer.insert_batch(
        Batch([sample[:2]] * 10, [sample.stamp] * 10, [pack_pose(*sample.pose)] * 10))
    (arrivals,) = doctor.pop_recent().values()
    assert arrivals.count == 11
    assert arrivals.incidents == {Kind.FAR_FUTURE: 11}
    assert arrivals.ahead == 60 * SECOND


def test_static_edges_do_not_count(buffer, doctor):
    buffer.insert('base', 'camera', 0, Pose(), static=True)
    assert doctor.pop_recent() == {}
    assert [one.static for one in doctor.signs()] == [True]


def test_clock_that_has_not_begun_gives_no_delays(buffer, doctor, clock):
    clock.now = 0
    buffer.insert('map', 'odom', 5 * SECOND, Pose())
    (arrivals,) = doctor.pop_recent().values()
    assert (arrivals.count, arrivals.timed, arrivals.mean_delay) == (1, 0, 0.0)


def test_observer_that_was_let_go_hears_no_more(buffer, doctor, clock):
    other = Doctor()
    buffer.observers.add(other)
    buffer.observers.remove(doctor)
    buffer.observers.remove(doctor)
    buffer.insert('map', 'odom', clock.now, Pose())
    assert doctor.pop_recent() == {}
    assert other.pop_recent()


def test_made_up_frames_do_not_eat_the_memory(buffer, doctor, clock):
    for first in range(0, 12_000, 1_000):
        buffer.insert_batch(Batch([('map', f'child{first + number}') for number in range(1_000)],
                                  [clock.now] * 1_000, [pack_pose(*Pose())] * 1_000))
    assert len(doctor.pop_recent()) <= 10_000
    assert doctor.transforms == 12_000


def test_threads_lose_no_count(buffer, doctor, clock):
    def insert(name):
        for number in range(500):
            buffer.insert('map', name, clock.now + number, Pose())

    threads = [threading.Thread(target=insert, args=(name,)) for name in 'aabb']
    for thread in threads:
        thread.start()
    count = 0
    while any(thread.is_alive() for thread in threads):
        count += sum(arrivals.count for arrivals in doctor.pop_recent().values())
    count += sum(arrivals.count for arrivals in doctor.pop_recent().values())
    assert count == 2_000


def test_observers_hear_by_hand_without_a_topic(buffer, clock):
    heard = []

    class Ear(Observer):

        def received(self, arrival):
            heard.append(arrival)

    buffer.observers.add(Ear())
    buffer.insert('map', 'odom', 7, Pose(x=1.0), authority='me')
    (arrival,) = heard
    assert arrival == (Batch([('map', 'odom')], [7], [pack_pose(*Pose(x=1.0))]), clock.now, '',
                       False, 'me')
