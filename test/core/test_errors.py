# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

import copy
import pickle

import pytest
from tf_tree_py import BufferCore, core
from tf_tree_py.core import (
    ConnectivityException,
    ExtrapolationException,
    FutureExtrapolationException,
    InvalidArgumentException,
    LATEST,
    LookupException,
    NoDataException,
    PastExtrapolationException,
    Pose,
    TimeoutException,
    TransformException,
)
from tf_tree_py.core.edges.samples import Samples
from tf_tree_py.core.tree.path import edge_to_blame

SECOND = 1_000_000_000
EXCEPTIONS = [value for value in vars(core).values()
              if isinstance(value, type) and issubclass(value, TransformException)]


@pytest.fixture
def buffer():
    return filled()


@pytest.fixture
def live():
    """Return the same in a buffer with a clock, where data may still arrive."""
    return filled(now=lambda: 12 * SECOND)


def filled(**options):
    buffer = BufferCore(10 * SECOND, **options)
    for seconds in (10, 11):
        buffer.insert('map', 'odom', seconds * SECOND, Pose(1.0))
        buffer.insert('odom', 'base', seconds * SECOND, Pose(1.0))
    buffer.insert('odom', 'base', 12 * SECOND, Pose(1.0))
    buffer.insert('island', 'tree', 0, Pose(), static=True)
    return buffer


def error_of(buffer, target, source, stamp=LATEST):
    with pytest.raises(TransformException) as raised:
        buffer.lookup(target, source, stamp)
    return raised.value


# --- the family


def test_family_is_that_of_tf2_and_its_refinements():
    assert {error.__name__ for error in EXCEPTIONS} >= {
        'TransformException', 'ConnectivityException', 'LookupException',
        'ExtrapolationException', 'InvalidArgumentException', 'TimeoutException'}
    for error in (ConnectivityException, LookupException, ExtrapolationException,
                  InvalidArgumentException, TimeoutException):
        assert error.__bases__ == (TransformException,)
    for error in (FutureExtrapolationException, PastExtrapolationException, NoDataException):
        assert error.__bases__ == (ExtrapolationException,)


@pytest.mark.parametrize('error', EXCEPTIONS)
def test_each_can_be_raised_with_nothing_but_a_text(error):
    with pytest.raises(error, match='^the server is gone$'):
        raise error('the server is gone')
    assert str(error()) == ''


@pytest.mark.parametrize('error', EXCEPTIONS)
@pytest.mark.parametrize('arguments', [(), ('text',), (1,), (None,), ('two', 'texts'), (7, b'')])
def test_each_takes_the_arguments_of_any_exception(error, arguments):
    """As tf2's classes do."""
    raised = error(*arguments)
    assert raised.args == arguments
    assert str(raised) == str(Exception(*arguments))
    assert str(pickle.loads(pickle.dumps(raised))) == str(raised)


@pytest.mark.parametrize('error', EXCEPTIONS)
def test_fact_that_an_error_does_not_have_is_none(error):
    raised = error('text')
    assert {getattr(raised, fact) for fact in (
        'target_frame', 'source_frame', 'parent', 'child', 'requested', 'oldest', 'latest',
        'waited_s', 'blocked_on')} == {None}
    assert raised.hint == ''


# --- texts begin as tf2's do, and contain the requested frames


@pytest.mark.parametrize(('target', 'source', 'stamp', 'error', 'text'), [
    ('nowhere', 'base', 0, LookupException,
     '"nowhere" passed to lookupTransform argument target_frame does not exist'),
    ('map', 'nowhere', 0, LookupException,
     '"nowhere" passed to lookupTransform argument source_frame does not exist'),
    ('/map', 'base', 0, InvalidArgumentException, "Invalid argument target_frame '/map'"),
    ('map', '', 0, InvalidArgumentException, "Invalid argument source_frame ''"),
    ('map', 'tree', 0, ConnectivityException,
     "Could not find a connection between 'map' and 'tree' because they are not part of the same "
     "tree: the root of 'map' is 'map', that of 'tree' is 'island'"),
    ('map', 'base', 12, FutureExtrapolationException,
     'Lookup would require extrapolation into the future. Requested time 12.000000000 but the '
     'latest data is at time 11.000000000, 1.000 s older, the edge map -> odom, when looking up '
     'transform from frame [base] to frame [map]'),
    ('map', 'base', 9, PastExtrapolationException,
     'Lookup would require extrapolation into the past. Requested time 9.000000000 but the '
     'earliest data is at time 10.000000000, 1.000 s newer, the edge map -> odom, when looking '
     'up transform from frame [base] to frame [map]'),
])
def test_text_begins_as_that_of_tf2(buffer, target, source, stamp, error, text):
    raised = error_of(buffer, target, source, stamp * SECOND)
    assert type(raised) is error
    assert str(raised).startswith(text)
    assert (raised.target_frame, raised.source_frame) == (target, source)


def test_text_of_an_empty_edge_names_the_frame_below_it(buffer):
    buffer.clear()
    raised = error_of(buffer, 'map', 'odom', 11 * SECOND)
    assert type(raised) is NoDataException
    assert str(raised).startswith(
        'Unable to lookup transform, cache is empty: no data for the edge above frame [odom]')
    assert (raised.child, raised.oldest, raised.latest) == ('odom', None, None)


# --- facts


def test_extrapolation_carries_the_edge_that_cannot_answer(buffer):
    raised = error_of(buffer, 'map', 'base', 12 * SECOND)
    assert (raised.parent, raised.child) == ('map', 'odom')
    assert (raised.requested, raised.oldest, raised.latest) == (
        12 * SECOND, 10 * SECOND, 11 * SECOND)
    # The error names the edge that lacks data, not another one of the path.
    raised = error_of(buffer, 'odom', 'base', 13 * SECOND)
    assert (raised.parent, raised.child) == ('odom', 'base')
    assert raised.latest == 12 * SECOND


@pytest.mark.parametrize(('target', 'source', 'stamp', 'blocked_on'), [
    # odom lacks the stamp; base has it until it leaves the window.
    ('map', 'base', 12 * SECOND, {('odom', 12 * SECOND), ('base', 22 * SECOND + 1)}),
    # Only late samples can help, while they are still accepted.
    ('map', 'base', 9 * SECOND, {('odom', 19 * SECOND + 1), ('base', 19 * SECOND + 1)}),
    # odom might still get a sample for it, but base has dropped it.
    ('map', 'base', SECOND, None),
    ('map', 'base', SECOND - 1, None),
    ('map', 'nowhere', LATEST, {(None, LATEST)}),
    ('map', 'tree', LATEST, {(None, LATEST)}),
    ('map', '/base', LATEST, None),
])
def test_error_tells_what_has_to_arrive_before_it_can_succeed(
        buffer, target, source, stamp, blocked_on):
    found = error_of(buffer, target, source, stamp).blocked_on
    assert (found and set(found)) == blocked_on


def test_worst_edge_without_data_is_to_blame():
    """Each of these is worse than those after it."""
    stamp, edges = 20, []
    for name, *stamps in (
            ('lost, and oldest at 35', 35, 50), ('lost, and oldest at 30', 30, 50),
            ('begins last', 40), ('begins later', 21), ('empty', ),
            ('ended first', 5, 10), ('ended later', 19)):
        edge = Samples(name, cache_time=25)
        for each in stamps:
            edge.insert(each, 'parent', Pose())
        edges.append(edge)
    for number, worst in enumerate(edges):
        assert edge_to_blame(edges[number:], stamp) is worst
        assert edge_to_blame(reversed(edges[number:]), stamp) is worst


def test_wrong_type_of_a_frame_is_an_invalid_argument(buffer):
    for frame in (None, 5, b'map', ['map']):
        assert isinstance(error_of(buffer, frame, 'base'), InvalidArgumentException)
        assert isinstance(error_of(buffer, 'map', frame), InvalidArgumentException)


# --- hints


def test_hint_for_the_future_is_a_timeout_or_the_sensors_stamp(live):
    raised = error_of(live, 'map', 'base', 12 * SECOND)
    assert raised.hint == (
        'Use a timeout that is long enough for the data to arrive. If this is the present time, '
        "pass the stamp of the sensor's own message instead")
    assert str(raised).endswith(f'.\n{raised.hint}')


def test_hint_for_the_future_without_a_clock_is_an_earlier_stamp(buffer):
    raised = error_of(buffer, 'map', 'base', 12 * SECOND)
    assert raised.hint == ('This edge has no newer sample: look up an earlier stamp. '
                           'stamps_at_rate returns stamps for which all edges have data')
    assert str(raised).endswith(f'.\n{raised.hint}')


def test_hint_for_what_is_long_silent_is_to_have_it_watched():
    buffer = filled(now=lambda: 12 * SECOND)
    newest = min(edge.latest for edge in buffer.edges_between('map', 'base'))
    doctor = 'tf_doctor reports whether it is late, silent, or stamped by another clock'
    assert doctor not in error_of(buffer, 'map', 'base', newest + SECOND).hint
    assert doctor in error_of(buffer, 'map', 'base', newest + SECOND + 1).hint
    assert doctor not in error_of(filled(), 'map', 'base', newest + SECOND + 1).hint


def test_hint_for_what_has_expired_is_a_longer_cache_time(buffer, live):
    longer = 'use a longer cache_time (UNLIMITED keeps everything)'
    assert error_of(buffer, 'map', 'base', SECOND - 1).hint == (
        f'The buffer keeps 10.000 s: {longer}')
    assert error_of(live, 'map', 'base', SECOND - 1).hint == (
        f'The buffer keeps 10.000 s: look up sooner, or {longer}')


def test_hint_for_what_was_before_the_beginning_is_that_nothing_older_came(buffer, live):
    assert error_of(buffer, 'map', 'base', 9 * SECOND).hint == (
        'This edge has no older sample: look up a later stamp. '
        'stamps_at_rate returns stamps for which all edges have data')
    assert error_of(live, 'map', 'base', 9 * SECOND).hint == (
        'No older sample of this edge has arrived: its publisher or the listener started later')


def test_hint_for_an_unknown_frame_is_the_known_ones(buffer):
    assert 'Known: odom, map, base, tree, island' in error_of(buffer, 'map', 'nowhere').hint
    assert error_of(BufferCore(), 'map', 'nowhere').hint == 'The buffer is empty'
    assert error_of(BufferCore(now=lambda: SECOND), 'map', 'nowhere').hint == (
        'Nothing has been received yet')


@pytest.mark.parametrize(('asked', 'meant'), [
    ('odomm', 'odom'), ('Base', 'base'), ('bace', 'base'), ('tre', 'tree'), ('base_link', 'base'),
    ('xyz', None), ('o' * 10**6, None),
])
def test_hint_for_a_slip_of_the_pen_is_what_was_meant(buffer, asked, meant):
    raised = error_of(buffer, 'map', asked)
    expected = f'Did you mean {meant!r}? ' if meant else ''
    known = ['odom', 'map', 'base', 'tree', 'island']
    known.sort(key=lambda name: name != meant)
    assert raised.hint == f"{expected}Known: {', '.join(known)}"
    assert str(raised).endswith(raised.hint)


def test_hint_is_that_of_the_moment_and_can_be_replaced(buffer):
    raised = error_of(buffer, 'map', 'odo')
    buffer.insert('odom', 'odo', 0, Pose(), static=True)
    unread = pickle.loads(pickle.dumps(raised))
    assert unread.hint == raised.hint
    assert raised.hint == "Did you mean 'odom'? Known: odom, map, base, tree, island"
    raised.hint = 'Start the publisher'
    assert str(raised).endswith('.\nStart the publisher')


def test_hint_is_sought_only_when_it_is_read(buffer, monkeypatch):
    raised = error_of(buffer, 'map', 'odo')
    monkeypatch.setattr('difflib.get_close_matches', lambda *_: ['read'])
    assert 'read' in str(raised)


def test_hint_does_not_list_a_thousand_frames():
    buffer = BufferCore()
    for number in range(1000):
        buffer.insert('map', f'frame{number}', 0, Pose(), static=True)
    hint = error_of(buffer, 'map', 'nowhere').hint
    assert 'and 989 more' in hint
    assert len(hint) < 200


def test_hint_for_two_trees_asks_who_joins_them(buffer, live):
    hint = error_of(live, 'map', 'tree').hint
    assert 'which node should publish the edge between them? tf_doctor lists the trees' in hint
    assert 'no edge joins them. tf_doctor lists the trees' in error_of(buffer, 'map', 'tree').hint


def test_time_that_was_waited_stands_before_the_hint():
    error = LookupException('nothing there', hint='Start the publisher')
    error.waited_s = 0.25
    assert str(error) == 'nothing there (waited 0.250 s for it).\nStart the publisher'
    assert error.describe() == 'nothing there'


# --- copies


@pytest.mark.parametrize(('target', 'source', 'stamp'), [
    ('map', 'base', 13 * SECOND), ('map', 'base', SECOND), ('map', 'base', 1),
    ('map', 'nowhere', LATEST), ('map', 'tree', LATEST), ('/map', 'base', LATEST),
])
def test_facts_survive_pickle_and_copy(buffer, target, source, stamp):
    error = error_of(buffer, target, source, stamp)
    error.waited_s = 0.5
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error), copy.deepcopy(error)):
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)


@pytest.mark.parametrize('error', EXCEPTIONS)
def test_plain_error_survives_pickle(error):
    again = pickle.loads(pickle.dumps(error('gone')))
    assert (type(again), str(again)) == (error, 'gone')


def test_wrong_type_of_a_frame_or_stamp_is_also_a_type_error(buffer):
    """The usual ``except TransformException`` would retry without end; a TypeError stops it."""
    for ask in (lambda: buffer.lookup('map', None), lambda: buffer.lookup('map', 'base', 1.5),
                lambda: buffer.lookup_many('map', 'base', [1.5]), lambda: BufferCore(10.0)):
        with pytest.raises(TypeError):
            ask()
    with pytest.raises(InvalidArgumentException) as raised:
        buffer.lookup('map', '')
    assert not isinstance(raised.value, TypeError)
