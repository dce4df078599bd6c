# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Lookups of the latest refuse a pose that is too old, and name the edge that has stopped."""

from copy import copy
import pickle
import threading

from hand_clock import HandClock
import numpy as np
from programs import PATIENCE_S
import pytest
from tf_tree_py import (
    BufferCore,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LATEST,
    load,
    lookup_twist,
    LookupException,
    PastExtrapolationException,
    Pose,
    StaleException,
    TransformException,
    UNLIMITED,
)
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.reports.audit import LookupAudit

S = 1_000_000_000
MS = 1_000_000
NOW = 1_700_000_000 * S
TURNED = Pose(1.0, 2.0, 3.0, 0.0, 0.6, 0.0, 0.8)
IN_MAP = Pose(4.0, -1.0, 0.5, 0.48, 0.0, 0.36, 0.8)


def robot(**options):
    """Return map <- odom <- base <- camera, at NOW; odom is 1.5 s old, base 20 ms."""
    buffer = BufferCore(now=HandClock(NOW), **options)
    for age in (2500 * MS, 1500 * MS):
        buffer.insert('map', 'odom', NOW - age, IN_MAP, authority='/amcl')
    for age in (2500 * MS, 1500 * MS, 20 * MS):
        buffer.insert('odom', 'base', NOW - age, TURNED, authority='/ekf')
    buffer.insert('base', 'camera', 0, TURNED, authority='/urdf', static=True)
    return buffer


# --- what is refused, and what is not

def test_the_latest_is_returned_up_to_the_limit():
    buffer = robot()
    at_any_age = buffer.lookup('map', 'camera')
    assert buffer.lookup('map', 'camera', max_age=1500 * MS) == at_any_age
    assert buffer.lookup('map', 'camera', LATEST, max_age=np.int64(1500 * MS)) == at_any_age
    with pytest.raises(StaleException):
        buffer.lookup('map', 'camera', max_age=1500 * MS - 1)
    assert buffer.lookup('odom', 'camera', max_age=20 * MS) == buffer.lookup('odom', 'camera')


def test_the_error_names_the_edge_its_publisher_and_all_ages():
    with pytest.raises(StaleException) as caught:
        robot().lookup('camera', 'map', max_age=100 * MS)
    error = caught.value
    assert isinstance(error, ExtrapolationException)
    assert str(error) == (
        "The latest data of the edge map -> odom, last published by '/amcl', is 1.500 s old, and "
        'max_age is 100 ms, when looking up transform from frame [map] to frame [camera].\n'
        'The other edges: odom -> base 20 ms. tf_doctor reports whether map -> odom is silent, '
        'late, or stamped by another clock')
    assert (error.parent, error.child, error.latest) == ('map', 'odom', NOW - 1500 * MS)
    assert (error.age, error.max_age, error.requested) == (1500 * MS, 100 * MS, None)
    assert [tuple(edge) for edge in error.ages] == [
        ('map', 'odom', '/amcl', NOW - 1500 * MS, 1500 * MS),
        ('odom', 'base', '/ekf', NOW - 20 * MS, 20 * MS)]


def test_of_two_stale_edges_the_older_is_named_and_the_other_is_listed():
    with pytest.raises(StaleException, match='the edge map -> odom, .*\n.*odom -> base 20 ms'):
        robot().lookup('map', 'camera', max_age=10 * MS)


LONG_DEAD = {
    'lookup': lambda tree, **limit: tree.lookup('map', 'camera', **limit),
    'lookup_uncertain': lambda tree, **limit: tree.lookup_uncertain('map', 'camera', **limit),
    'lookup_newest': lambda tree, **limit: tree.lookup_newest('map', 'camera', **limit),
    'lookup_tree': lambda tree, **limit: tree.lookup_tree('map', **limit)}


def long_dead(**options):
    """Return a robot whose localisation stopped 20 s ago, longer than the buffer keeps data."""
    buffer = BufferCore(now=HandClock(NOW), **options)
    for age in (21 * S, 20 * S):
        buffer.insert('map', 'odom', NOW - age, IN_MAP, authority='/amcl')
    for number in range(201):
        buffer.insert('odom', 'base', NOW - (200 - number) * 100 * MS, TURNED, authority='/ekf')
    buffer.insert('base', 'camera', 0, TURNED, static=True)
    return buffer


@pytest.mark.parametrize('lookup', LONG_DEAD.values(), ids=LONG_DEAD)
def test_an_edge_that_stopped_longer_ago_than_the_buffer_keeps_is_named(lookup):
    for tree, limit in (long_dead(), {'max_age': S}), (long_dead(max_age=S), {}):
        with pytest.raises(StaleException, match="map -> odom, .* '/amcl', is 20.000 s old"):
            lookup(tree, **limit)


def test_also_without_a_limit_the_error_says_which_edge_holds_the_latest_back():
    with pytest.raises(PastExtrapolationException) as caught:
        long_dead().lookup('map', 'camera')
    assert 'the edge odom -> base' in str(caught.value)
    assert caught.value.hint == (
        'The latest time is so old because nothing newer of the edge map -> odom, last published '
        "by '/amcl', has arrived: tf_doctor reports whether map -> odom is silent, late, or "
        'stamped by another clock')
    with pytest.raises(PastExtrapolationException, match="by '/amcl', has arrived$"):
        BufferCore.lookup(long_dead().snapshot(), 'map', 'camera')


def test_an_edge_that_has_just_begun_is_not_explained_by_another():
    buffer = BufferCore(now=HandClock(NOW))
    for age in 180 * MS, 80 * MS:
        buffer.insert('map', 'odom', NOW - age, IN_MAP, authority='/amcl')
    buffer.insert('odom', 'base', NOW - 20 * MS, TURNED, authority='/ekf')
    with pytest.raises(PastExtrapolationException, match='No older sample of this edge has arr'):
        buffer.lookup('map', 'base')


def test_many_other_edges_are_counted():
    buffer = BufferCore(now=HandClock(NOW))
    frames = [f'f{number}' for number in range(12)]
    for number, (parent, child) in enumerate(zip(frames, frames[1:], strict=False)):
        for age in 2 * S, (number + 1) * 10 * MS:
            buffer.insert(parent, child, NOW - age, TURNED)
    with pytest.raises(StaleException) as caught:
        buffer.lookup('f0', 'f11', max_age=0)
    assert [edge.child for edge in caught.value.ages] == [f'f{n}' for n in range(11, 0, -1)]
    assert 'f9 -> f10 100 ms, f8 -> f9 90 ms' in caught.value.hint
    assert ' and 2 more. tf_doctor reports whether f10 -> f11' in caught.value.hint
    with pytest.raises(StaleException) as caught:
        buffer.snapshot().lookup('f10', 'f11', max_age=0)
    assert caught.value.hint == ''


def test_other_stamps_have_no_limit():
    buffer = robot(max_age=1)
    stamp = NOW - 2000 * MS
    assert buffer.lookup('map', 'odom', stamp, max_age=1) == buffer.lookup('map', 'odom', stamp)
    assert buffer.lookup_at('map', 'odom', stamp) == buffer.lookup('map', 'odom', stamp)


@pytest.mark.parametrize(('target', 'source'), [
    ('camera', 'camera'), ('base', 'camera'), ('camera', 'base'), ('odom', 'odom'),
    ('nowhere', 'nowhere')], ids=['a frame in itself', 'down static edges', 'up static edges',
                                  'a moving frame in itself', 'an unknown frame in itself'])
def test_what_does_not_move_is_never_stale(target, source):
    buffer = robot(max_age=0)
    assert buffer.lookup(target, source, max_age=0) == buffer.lookup(
        target, source, max_age=UNLIMITED)
    assert buffer.lookup_newest(target, source, max_age=0).stamps == {}


def test_a_tree_of_static_edges_alone_is_never_stale():
    buffer = BufferCore(now=HandClock(NOW), max_age=0)
    buffer.insert('base', 'camera', 0, TURNED, static=True)
    assert set(buffer.lookup_tree('base')) == {'base', 'camera'}
    assert buffer.lookup_uncertain('base', 'camera')[0] == buffer.lookup('base', 'camera')


def errors_of(*calls):
    errors = []
    for call in calls:
        with pytest.raises(Exception) as caught:
            call()
        errors.append((type(caught.value), str(caught.value)))
    return errors


@pytest.mark.parametrize(('target', 'source'), [
    ('map', 'nowhere'), ('/map', 'base'), ('map', 'hut'), ('', 'base')])
def test_other_errors_are_the_same(target, source):
    buffer = robot()
    buffer.insert('island', 'hut', NOW, TURNED)
    plain, limited, of_each = errors_of(
        lambda: buffer.lookup(target, source),
        lambda: buffer.lookup(target, source, max_age=S),
        lambda: buffer.lookup_newest(target, source))
    assert plain == limited == of_each


def test_an_empty_tree_and_two_trees_have_no_age():
    empty = BufferCore(now=HandClock(NOW))
    for lookup in empty.lookup, empty.lookup_newest:
        with pytest.raises(LookupException):
            lookup('map', 'base', max_age=S)
    buffer = robot()
    buffer.insert('island', 'hut', NOW, TURNED)
    with pytest.raises(ConnectivityException):
        buffer.lookup('map', 'hut', max_age=0)


def test_a_stamp_ahead_of_the_clock_is_fresh():
    buffer = robot()
    buffer.insert('map', 'odom', NOW + 900 * MS, IN_MAP, authority='/amcl')
    assert buffer.lookup('map', 'odom', max_age=0)
    with pytest.raises(StaleException, match='map -> odom 900 ms ahead of the clock'):
        buffer.lookup('map', 'camera', max_age=10 * MS)


# --- the clock

def test_the_age_is_that_of_the_clock_when_it_is_asked():
    clock = HandClock(NOW)
    buffer = BufferCore(now=clock)
    buffer.insert('map', 'base', NOW, TURNED)
    buffer.lookup('map', 'base', max_age=100 * MS)
    clock.now += 101 * MS
    with pytest.raises(StaleException, match='101 ms old'):
        buffer.lookup('map', 'base', max_age=100 * MS)
    clock.now -= 5 * S  # the clock is set back
    buffer.lookup('map', 'base', max_age=0)


def test_before_the_clock_starts_an_age_is_unknown_and_nothing_moving_is_fresh():
    clock = HandClock(0)
    buffer = BufferCore(now=clock)
    buffer.insert('map', 'base', 3 * S, TURNED)
    buffer.insert('base', 'camera', 0, TURNED, static=True)
    with pytest.raises(StaleException) as caught:
        buffer.lookup('map', 'camera', max_age=S)
    assert caught.value.age is None
    assert str(caught.value) == (
        'The age of the latest transform is unknown, and max_age is 1.000 s: the clock that the '
        'stamps follow has not started, when looking up transform from frame [camera] to frame '
        '[map].\nWith use_sim_time, does any node publish /clock?')
    assert buffer.lookup('base', 'camera', max_age=S)
    clock.now = 3 * S + 1
    assert buffer.lookup('map', 'camera', max_age=S)


def test_a_stamp_of_zero_is_as_old_as_the_clock():
    buffer = BufferCore(now=HandClock(2 * S))
    buffer.insert('map', 'base', 0, TURNED)
    assert buffer.lookup('map', 'base', max_age=2 * S)
    with pytest.raises(StaleException):
        buffer.lookup('map', 'base', max_age=S)


@pytest.mark.parametrize('lookup', [
    lambda tree: tree.lookup('map', 'base', max_age=S),
    lambda tree: tree.lookup('base', 'base', max_age=S),
    lambda tree: tree.lookup_newest('map', 'base', max_age=S),
    lambda tree: tree.lookup_tree('map', max_age=S),
    lambda tree: tree.lookup_uncertain('map', 'base', max_age=S),
    lambda tree: tree.lookup_within(0.0, 'map', 'base', max_age=S)])
def test_without_a_clock_the_error_says_what_to_pass(lookup):
    buffer = BufferCore()
    buffer.insert('map', 'base', NOW, TURNED)
    with pytest.raises(InvalidArgumentException, match='pass now, such as time.time_ns, when you'):
        lookup(buffer)


def test_without_a_clock_there_is_no_default_and_any_age_is_right():
    buffer = BufferCore(max_age=UNLIMITED)
    for call in (lambda: BufferCore(max_age=S), lambda: setattr(buffer, 'max_age', S)):
        with pytest.raises(InvalidArgumentException, match='pass now, such as time.time_ns'):
            call()
    buffer.insert('map', 'base', NOW, TURNED)
    assert buffer.max_age is None
    assert buffer.lookup('map', 'base', max_age=UNLIMITED) == TURNED
    assert buffer.lookup('map', 'base', NOW, max_age=S) == TURNED


def test_a_default_can_be_set_and_removed():
    buffer = robot()
    buffer.max_age = S
    with pytest.raises(StaleException):
        buffer.lookup('map', 'base')
    buffer.max_age = None
    assert buffer.lookup('map', 'base')


@pytest.mark.parametrize('wrong', [0.5, '1', 1.0, True])
def test_a_limit_is_integer_nanoseconds(wrong):
    buffer = robot()
    for call in (lambda: robot(max_age=wrong), lambda: buffer.lookup('a', 'b', max_age=wrong),
                 lambda: buffer.lookup('a', 'b', NOW, max_age=wrong),
                 lambda: buffer.lookup_uncertain('a', 'b', NOW, max_age=wrong),
                 lambda: buffer.lookup_tree('map', NOW, max_age=wrong)):
        with pytest.raises(InvalidArgumentException, match='max_age .*must be integer nanosec'):
            call()


def test_a_limit_is_not_negative():
    for call in (lambda: robot(max_age=-1), lambda: robot().lookup('map', 'base', max_age=-1)):
        with pytest.raises(InvalidArgumentException, match='max_age -1.*cannot be negative'):
            call()


# --- the default of a buffer

LATEST_BY_ALL = {
    'lookup': lambda tree: tree.lookup('map', 'camera'),
    'lookup_stamped': lambda tree: tree.lookup_stamped('map', 'camera'),
    'lookup_framed': lambda tree: tree.lookup_framed('map', 'camera'),
    'lookup_full': lambda tree: tree.lookup_full('map', LATEST, 'camera', NOW - 20 * MS, 'odom'),
    'the other half': lambda tree: tree.lookup_full(
        'base', NOW - 1500 * MS, 'map', LATEST, 'odom'),
    'lookup_tree': lambda tree: tree.lookup_tree('camera'),
    'lookup_newest': lambda tree: tree.lookup_newest('map', 'camera'),
    'lookup_uncertain': lambda tree: tree.lookup_uncertain('map', 'camera'),
    'lookup_uncertain_full': lambda tree: tree.lookup_uncertain_full(
        'map', LATEST, 'camera', NOW - 20 * MS, 'odom'),
    'lookup_budget': lambda tree: tree.lookup_budget('map', 'camera'),
    'lookup_joint': lambda tree: tree.lookup_joint('map', ['map', 'base', 'camera']),
    'predict': lambda tree: tree.predict('map', 'camera', LATEST, S),
    'lookup_twist': lambda tree: lookup_twist(tree, 'camera', 'map', LATEST, 100 * MS),
}


@pytest.mark.parametrize('lookup', LATEST_BY_ALL.values(), ids=LATEST_BY_ALL)
@pytest.mark.parametrize('certain', [True, False], ids=['certain', 'uncertain'])
def test_the_default_holds_for_each_lookup_of_the_latest(lookup, certain):
    fresh, stale = robot(max_age=1500 * MS), robot(max_age=1500 * MS - 1)
    for buffer in fresh, stale:
        if not certain:
            buffer.insert('map', 'odom', NOW - 1500 * MS, IN_MAP, authority='/amcl',
                          covariance=np.eye(6) * 1e-4)
    lookup(fresh)
    lookup(fresh.snapshot())
    for tree in stale, stale.snapshot():
        with pytest.raises(StaleException) as caught:
            lookup(tree)
        assert (caught.value.child, caught.value.age) == ('odom', 1500 * MS)


def test_an_argument_replaces_the_default():
    buffer = robot(max_age=10 * MS)
    assert buffer.max_age == 10 * MS
    for limit in 1500 * MS, UNLIMITED:
        buffer.lookup('map', 'camera', max_age=limit)
        buffer.lookup_newest('map', 'camera', max_age=limit)
        buffer.lookup_uncertain('map', 'camera', max_age=limit)
        buffer.lookup_within(0.0, 'map', 'camera', max_age=limit)
        assert len(buffer.lookup_tree('map', max_age=limit)) == 4
    generous = robot(max_age=UNLIMITED)
    for lookup in (generous.lookup, generous.lookup_newest, generous.lookup_uncertain):
        lookup('map', 'camera')
        with pytest.raises(StaleException):
            lookup('map', 'camera', max_age=S)


def test_all_frames_are_as_old_as_the_slowest_edge_of_the_tree():
    buffer = robot()
    assert buffer.lookup_tree('base', max_age=1500 * MS) == buffer.lookup_tree('base')
    with pytest.raises(StaleException, match=r'map -> odom.*when looking up all frames in \[base'):
        buffer.lookup_tree('base', max_age=S)
    assert buffer.lookup_tree('base', NOW - 1600 * MS, max_age=0) == buffer.lookup_tree(
        'base', NOW - 1600 * MS)


def test_with_covariances_the_answers_are_the_same():
    buffer = robot()
    buffer.insert('map', 'odom', NOW - 1500 * MS, IN_MAP, covariance=np.eye(6) * 1e-4)
    pose, covariance = buffer.lookup_uncertain('map', 'camera')
    limited, again = buffer.lookup_uncertain('map', 'camera', max_age=1500 * MS)
    assert pose == limited
    np.testing.assert_array_equal(covariance, again)


# --- a snapshot, a file, other processes

def test_a_smoothed_snapshot_has_the_time_at_which_it_was_taken():
    buffer = robot(max_age=S)
    buffer.correct('odom', Pose(x=0.1), max_speed=0.1, max_turn_rate=0.1)
    for tree in buffer, buffer.smoothed():
        with pytest.raises(StaleException):
            tree.lookup('map', 'base')
        assert tree.lookup('map', 'base', max_age=2 * S)
    assert buffer.smoothed().lookup('map', 'odom', max_age=2 * S) != buffer.lookup(
        'map', 'odom', max_age=2 * S)


def test_a_snapshot_has_the_time_at_which_it_was_taken():
    clock = HandClock(NOW)
    buffer = BufferCore(now=clock, max_age=100 * MS)
    buffer.insert('map', 'base', NOW, TURNED)
    still = buffer.snapshot()
    clock.now += S
    with pytest.raises(StaleException):
        buffer.lookup('map', 'base')
    for copied in still, still.snapshot(), pickle.loads(pickle.dumps(still)), copy(still):
        assert copied.lookup('map', 'base', max_age=0) == copied.lookup('map', 'base') == TURNED
    with pytest.raises(StaleException, match='1.000 s old'):
        buffer.snapshot().lookup('map', 'base')


def test_a_file_has_no_clock(tmp_path):
    path = tmp_path / 'run.tftree'
    robot(max_age=0).save(path)
    assert load(path).lookup('map', 'camera')
    with pytest.raises(InvalidArgumentException, match='a recording has none'):
        load(path).lookup('map', 'camera', max_age=S)
    with pytest.raises(InvalidArgumentException, match='only if its buffer has a clock'):
        BufferCore().snapshot().lookup('map', 'camera', max_age=S)


def test_the_error_can_be_copied_and_sent():
    with pytest.raises(StaleException) as caught:
        robot().lookup('map', 'camera', max_age=0)
    for other in copy(caught.value), pickle.loads(pickle.dumps(caught.value)):
        assert str(other) == str(caught.value)
        assert (other.age, other.ages) == (caught.value.age, caught.value.ages)
    assert str(StaleException('too old')) == 'too old'


# --- waiting

def test_a_wait_ends_with_the_fresh_sample():
    buffer = robot()
    asked = threading.Event()
    found = []

    class Watch(Observer):

        def asked(self, target, source, stamp):
            asked.set()

    buffer.observers.add(Watch())
    thread = threading.Thread(target=lambda: found.append(buffer.lookup_within(
        PATIENCE_S, 'map', 'camera', max_age=100 * MS)))
    thread.start()
    asked.wait(PATIENCE_S)
    buffer.insert('odom', 'base', NOW, TURNED)  # not the one that is old
    buffer.insert('map', 'odom', NOW - 101 * MS, IN_MAP)  # still too old
    buffer.insert('map', 'odom', NOW - 100 * MS, TURNED)
    thread.join(PATIENCE_S)
    assert found == [buffer.lookup('map', 'camera')]


def test_a_wait_sleeps_until_the_old_edge_has_reached_the_limit():
    buffer = robot()
    with pytest.raises(StaleException) as caught:
        buffer.lookup('map', 'camera', max_age=100 * MS)
    assert caught.value.blocked_on == (('odom', NOW - 100 * MS),)
    with pytest.raises(StaleException) as caught:
        buffer.lookup('map', 'camera', max_age=10 * MS)
    assert set(caught.value.blocked_on) == {('odom', NOW - 10 * MS), ('base', NOW - 10 * MS)}


def test_a_wait_in_vain_ends_with_the_error_and_its_duration():
    for limits in {'max_age': 100 * MS}, {}:
        with pytest.raises(StaleException, match=r'\(waited \d') as caught:
            robot(max_age=100 * MS).lookup_within(0.02, 'map', 'camera', **limits)
        assert caught.value.waited_s >= 0.02


def test_observers_see_one_lookup_that_fails():
    seen = []

    class Watch(Observer):

        def asked(self, target, source, stamp):
            return lambda error: seen.append((target, source, stamp, type(error)))

    buffer = robot()
    buffer.observers.add(Watch())
    for lookup in (buffer.lookup, buffer.lookup_newest, buffer.lookup_uncertain):
        with pytest.raises(StaleException):
            lookup('map', 'camera', max_age=0)
        lookup('map', 'camera', max_age=UNLIMITED)
    assert seen == 3 * [('map', 'camera', None, StaleException),
                        ('map', 'camera', None, type(None))]


def test_a_joint_lookup_is_seen_once_also_with_a_default():
    seen = []

    class Watch(Observer):

        def asked(self, target, source, stamp):
            seen.append(source)

    for limit in {}, {'max_age': 2 * S}:
        buffer = robot(**limit)
        buffer.observers.add(Watch())
        buffer.lookup_joint('map', ['odom', 'base'])
    assert seen == 2 * ['odom', 'base']


def test_an_audit_counts_what_was_answered():
    buffer = robot(max_age=10 * MS)
    audit = LookupAudit(buffer, lambda: NOW)
    buffer.observers.add(audit)
    buffer.lookup('map', 'base', max_age=UNLIMITED)
    buffer.lookup_newest('map', 'base', max_age=UNLIMITED)
    with pytest.raises(StaleException):
        buffer.lookup('map', 'base')
    lines = audit.lines()
    assert sum(line.lookups for line in lines) == 3
    assert sum(line.failed for line in lines) == 1


# --- other kinds of edges

def test_an_edge_that_changes_its_parent_is_asked_by_its_newest_sample():
    buffer = robot()
    buffer.insert('map', 'cup', NOW - 3 * S, TURNED)
    buffer.insert('camera', 'cup', NOW - 10 * MS, TURNED)
    with pytest.raises(StaleException, match='map -> odom'):
        buffer.lookup('map', 'cup', max_age=S)
    assert buffer.lookup('base', 'cup', max_age=10 * MS) == TURNED @ TURNED


def test_after_a_clear_the_error_is_that_of_missing_data():
    buffer = robot(max_age=S)
    buffer.clear()
    with pytest.raises(TransformException, match='clear.. was called') as caught:
        buffer.lookup('map', 'camera')
    assert not isinstance(caught.value, StaleException)
