# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What observers of a buffer receive, in which order, and when they receive nothing."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from tf_tree_py.core import Kind, LATEST, LookupException, PlainBuffer, Pose
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import (
    asked,
    halves,
    newest_of,
    NO_OBSERVERS,
    Observer,
    Observers,
    ReceivedMessage,
)
from tf_tree_py.core.messages.sample import Batch, ImpossibleStamp

POSE = pack_pose(*Pose(1.0))


class All(Observer):
    """Keeps what it receives."""

    def __init__(self, log=None, *, ends=True):
        self.log = [] if log is None else log
        self.ends = ends

    def received(self, arrival):
        self.log.append(('received', arrival))

    def saw_incidents(self, incidents):
        self.log.append(('incidents', [incident.kind for incident in incidents]))

    def asked(self, target, source, stamp):
        self.log.append(('asked', target, source, stamp))
        return self._end if self.ends else None

    def _end(self, error):
        self.log.append(('end', error))


class OnlyLookups(Observer):
    """Overrides one method."""

    def asked(self, target, source, stamp):
        """Observe nothing."""


# --- the list

def test_observers_are_sorted_by_what_they_need():
    observers, one, other = Observers(), All(), OnlyLookups()
    assert len(observers) == 0
    for each in (one, other):
        observers.add(each)
    assert len(observers) == 2
    assert observers.of_messages == observers.of_incidents == (one,)
    assert observers.of_lookups == (one, other)
    observers.remove(All())
    assert len(observers) == 2
    observers.remove(one)
    assert (len(observers), observers.of_messages, observers.of_lookups) == (1, (), (other,))
    observers.remove(other)
    assert (len(observers), observers.of_lookups) == (0, ())
    with pytest.raises(TypeError):
        bool(observers)


def test_plain_observer_does_nothing():
    observer = Observer()
    assert observer.received(None) is observer.saw_incidents([]) is None
    assert observer.asked('a', 'b', 5) is None
    observers = Observers()
    observers.add(observer)
    assert observers.of_messages == observers.of_incidents == observers.of_lookups == ()
    assert len(NO_OBSERVERS) == 0


# --- arrivals and incidents

def test_message_is_notified_without_its_impossible_stamps():
    observers, one, other = Observers(), All(), All()
    observers.add(one)
    observers.add(other)
    batch = Batch([('a', 'b')], [5], [POSE], ['/a'])
    arrival = ReceivedMessage(batch, 7, '/tf', True, 'me')
    observers.notify_received(arrival)
    assert one.log[0][1] is arrival
    bad = batch._replace(impossible=[ImpossibleStamp('a', 'c', 1, 10**9)])
    observers.notify_received(arrival._replace(batch=bad))
    observers.notify_received(ReceivedMessage(batch, 8, '/tf'))
    assert one.log == other.log == [
        ('received', arrival), ('received', arrival._replace(batch=batch)),
        ('received', ReceivedMessage(batch, 8, '/tf', False, ''))]


def test_buffer_notifies_of_each_insertion_and_its_incidents():
    buffer, one = PlainBuffer(now=lambda: 9), All()
    buffer.observers.add(one)
    batch = Batch([('a', 'b'), ('b', 'b')], [5, 6], [POSE] * 2)
    buffer.insert_batch(batch, 'me')
    buffer.insert('a', 'c', 7, Pose(1.0), authority='you', static=True)
    buffer.insert_batch(batch, 'me', announced=True)
    buffer.insert_batch(batch._replace(edges=[('a', 'b'), ('b', 'd')]), 'them', True)
    assert one.log == [
        ('received', ReceivedMessage(batch, 9, '', False, 'me')),
        ('incidents', [Kind.SELF_EDGE]),
        ('received', ReceivedMessage(Batch([('a', 'c')], [7], [POSE]), 9, '', True, 'you')),
        ('incidents', [Kind.SELF_EDGE]),
        ('received', ReceivedMessage(
            batch._replace(edges=[('a', 'b'), ('b', 'd')]), 9, '', True, 'them')),
        ('incidents', [Kind.KIND_CHANGE])]


# --- lookups

def test_lookup_is_reported_once_with_its_end():
    buffer, log = PlainBuffer(), []
    buffer.insert('map', 'base', 5, Pose(1.0))
    for each in (All(log), All(log, ends=False), All(log)):
        buffer.observers.add(each)
    assert buffer.lookup('map', 'base', 5) == Pose(1.0)
    asking, end = ('asked', 'map', 'base', 5), ('end', None)
    assert log == [asking] * 3 + [end] * 2
    del log[:]
    with pytest.raises(LookupException) as raised:
        buffer.lookup('map', 'arm')
    assert log == [('asked', 'map', 'arm', None)] * 3 + [('end', raised.value)] * 2
    del log[:]
    assert buffer.lookup_within(0.0, 'map', 'base') == Pose(1.0)
    assert log == [('asked', 'map', 'base', None)] * 3 + [end] * 2


def test_lookups_of_an_observer_or_a_quiet_thread_are_not_reported():
    buffer = PlainBuffer()
    buffer.insert('map', 'base', 5, Pose(1.0))
    observers = buffer.observers

    class Curious(All):
        """Looks up while it is notified of an end."""

        def _end(self, error):
            assert not observers.watches_lookups()
            self.log.append(buffer.lookup('map', 'base', 5))

    one = Curious()
    assert not observers.watches_lookups()
    observers.add(one)
    assert observers.watches_lookups()
    buffer.lookup('map', 'base', 5)
    assert one.log == [('asked', 'map', 'base', 5), Pose(1.0)]
    with observers.quiet():
        with observers.quiet():
            assert not observers.watches_lookups()
        assert not observers.watches_lookups()
        buffer.lookup('map', 'base', 5)
        assert observers.watch([('a', 'b', 1)], lambda number: number + 1, 3) == 4
        observers.begin(('a', 'b', 1))(None)
        with ThreadPoolExecutor(1) as pool:
            assert pool.submit(observers.watches_lookups).result()
    assert len(one.log) == 2
    assert observers.watches_lookups()
    with pytest.raises(KeyError), observers.quiet():
        raise KeyError
    assert observers.watches_lookups()


def test_query_that_is_watched_is_quiet_itself():
    observers, one = Observers(), All()
    observers.add(one)
    assert observers.watch([('a', 'b', 1), ('c', 'd', None)],
                           lambda *numbers: (numbers, observers.watches_lookups()), 3, 4
                           ) == ((3, 4), False)
    assert one.log == [('asked', 'a', 'b', 1), ('asked', 'c', 'd', None), ('end', None),
                       ('end', None)]
    end = observers.begin(('a', 'b', 1))
    assert observers.watches_lookups()
    end(error := LookupException('gone'))
    assert one.log[4:] == [('asked', 'a', 'b', 1), ('end', error)]


def test_lookups_have_the_form_that_observers_receive():
    assert asked('a', 'b', 5) == ('a', 'b', 5)
    assert asked('a', 'b', LATEST) == ('a', 'b', None)
    assert halves('a', 5, 'b', 0, 'map') == [('map', 'b', None), ('a', 'map', 5)]
    (newest,) = newest_of('a', 'b', np.array([3, 9, 5]))
    assert (newest, type(newest[2])) == (('a', 'b', 9), int)
    assert newest_of('a', 'b', np.array([7])) == [('a', 'b', 7)]
    assert newest_of('a', 'b', np.array([], dtype=np.int64)) == []
