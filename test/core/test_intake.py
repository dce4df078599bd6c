# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What an insertion returns, counts, notifies and clears, whole; whatever the way in."""

import copy

from hand_clock import HandClock
import numpy as np
import pytest
from tf_tree_py.core import (
    ClockJumpException,
    Incident,
    InvalidArgumentException,
    Kind,
    LATEST,
    Linear,
    PlainBuffer,
    Pose,
    RefusedException,
    Sample,
    TransformException,
    TransformWarning,
)
from tf_tree_py.core.buffer.waiting import Inquiry, WallDeadline
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.observers import Observer
from tf_tree_py.core.messages.sample import Batch, ImpossibleStamp

SECOND = 10**9
NOW = 1000 * SECOND
NAN = Pose(float('nan'))
LONG = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0)
AUTHORITY = 'default_authority'
OLD = ('A bag that loops, a simulation that was restarted, or a second publisher whose clock is '
       'slow')


class Log(Observer):
    """Keeps the edges and stamps of arrivals, and the kinds of incidents."""

    def __init__(self):
        self.log = []

    def received(self, arrival):
        self.log.append((*arrival[1:], arrival.batch.edges[0], *arrival.batch.stamps))

    def saw_incidents(self, incidents):
        self.log.append([incident.kind for incident in incidents])


def watched(**options):
    buffer, log = PlainBuffer(**options), Log()
    buffer.observers.add(log)
    return buffer, log.log


def batch(*transforms):
    """Return a batch of (parent, child, stamp) with a pose or without."""
    return Batch([each[:2] for each in transforms], [each[2] for each in transforms],
                 [pack_pose(*(each[3] if len(each) > 3 else Pose(1.0))) for each in transforms])


def counts(buffer):
    statistics = buffer.statistics()
    return statistics.accepted, {kind: count for kind, count in statistics.incidents.items()
                                 if count}, statistics.frames


def kinds(incidents):
    return [incident.kind for incident in incidents]


# --- one by one

def test_samples_are_inserted_one_after_the_other():
    buffer, log = watched(now=HandClock(NOW))
    assert buffer.insert_many([]) == []
    got = buffer.insert_many([
        Sample('map', 'base', 5, Pose(1.0)), Sample('map', 'map', 6, Pose()),
        Sample('map', 'base', 7, Pose(2.0)), Sample('base', 'map', 8, Pose(3.0)),
        Sample('base', 'arm', 9, Pose(4.0))], 'me', strict=False)
    assert kinds(got) == [Kind.SELF_EDGE, Kind.LOOP]
    assert log == [*((NOW, '', False, 'me', edge, stamp) for edge, stamp in (
        (('map', 'base'), 5), (('map', 'map'), 6), (('map', 'base'), 7), (('base', 'map'), 8),
        (('base', 'arm'), 9))), [Kind.SELF_EDGE, Kind.LOOP]]
    assert counts(buffer) == (3, {Kind.SELF_EDGE: 1, Kind.LOOP: 1}, 3)
    assert buffer.lookup('map', 'base', 6) == Pose(1.5)


def test_remarks_do_not_keep_a_sample_from_being_counted():
    buffer = PlainBuffer()
    buffer.insert('map', 'base', 5, Pose(), authority='me')
    assert kinds(buffer.insert('odom', 'base', 6, Pose(), authority='you', strict=False)) == [
        Kind.SECOND_PARENT]
    assert counts(buffer) == (2, {Kind.SECOND_PARENT: 1}, 3)


def test_statistics_are_a_copy():
    buffer = PlainBuffer()
    buffer.insert('map', 'base', 5, Pose())
    buffer.statistics().incidents[Kind.LOOP] += 5
    assert counts(buffer) == (1, {}, 2)
    buffer.intake.refuse(Incident(Kind.LOOP, 'a', 'b', 5, 'me', 'why'),
                         Incident(Kind.LOOP, 'a', 'b', 5, 'me', 'why'))
    assert counts(buffer) == (1, {Kind.LOOP: 2}, 2)


@pytest.mark.parametrize(('stamp', 'far'), [(NOW + SECOND, False), (NOW + SECOND + 1, True)])
@pytest.mark.parametrize('way', ['insert', 'insert_many', 'insert_batch', 'insert_track'])
def test_stamp_too_far_ahead_is_refused_whatever_the_way_in(way, stamp, far):
    buffer, log = watched(now=HandClock(NOW), max_future=SECOND)
    assert buffer.intake.is_too_far(stamp) is far
    sample = 'map', 'base', stamp
    got = {
        'insert': lambda: buffer.insert(*sample, Pose(1.0), strict=False),
        'insert_many': lambda: buffer.insert_many([Sample(*sample, Pose(1.0))], strict=False),
        'insert_batch': lambda: buffer.insert_batch(batch(sample)),
        'insert_track': lambda: buffer.insert_track('map', 'base', [stamp], [Pose(1.0)],
                                                    strict=False)}[way]()
    assert kinds(got) == [Kind.FAR_FUTURE] * far
    assert counts(buffer) == ((0, {Kind.FAR_FUTURE: 1}, 0) if far else (1, {}, 2))
    assert log == [(NOW, '', False, AUTHORITY, ('map', 'base'), stamp),
                   *[[Kind.FAR_FUTURE]] * far]


def test_static_transforms_are_not_compared_with_the_clock():
    clock = HandClock(NOW)
    buffer = PlainBuffer(now=clock, max_future=0, clear_on_jump_back=SECOND)
    buffer.insert('a', 'b', NOW, Pose())
    read = clock.read
    for stamp in (NOW + 9 * SECOND, 1):
        assert buffer.insert_batch(batch(('map', 'base', stamp)), 'me', True) == []
        assert buffer.insert('map', 'base', stamp, Pose(1.0), authority='me', static=True) == []
    assert clock.read == read
    assert buffer.lookup('map', 'base', 5) == Pose(1.0)


# --- whole messages

@pytest.mark.parametrize('poses', [[LONG], [LONG] * 8, [(0.0,) * 7] * 8, [(0.0,) * 7]],
                         ids=['one', 'many', 'many without rotation', 'one without rotation'])
def test_poses_of_a_message_are_normalised_or_refused(poses):
    buffer = PlainBuffer()
    names = [('map', f'child{number}') for number in range(len(poses))]
    for stamp in (5, 6):
        got = buffer.insert_batch(batch(*((*edge, stamp, pose) for edge, pose
                                          in zip(names, poses, strict=True))))
        assert kinds(got) == ([] if any(poses[0]) else [Kind.ZERO_ROTATION] * len(poses))
    for _, child in names if any(poses[0]) else ():
        assert buffer.lookup('map', child, 6) == Pose(1.0)


def test_message_without_transforms_changes_nothing():
    buffer = PlainBuffer(clear_on_jump_back=SECOND)
    for static in (False, True):
        assert buffer.insert_batch(Batch((), (), ()), 'me', static) == []
    assert counts(buffer) == (0, {}, 0)


def test_impossible_stamps_come_first():
    buffer = PlainBuffer()
    bad = [ImpossibleStamp('map', 'imu', 3, 2 * SECOND), ImpossibleStamp('map', 'arm', 4, SECOND)]
    got = buffer.insert_batch(batch(('map', 'base', 5), ('map', 'map', 6))._replace(
        impossible=bad), 'me')
    assert got[:2] == [stamp.incident('me') for stamp in bad]
    assert kinds(got[2:]) == [Kind.SELF_EDGE]
    assert counts(buffer) == (1, {Kind.IMPOSSIBLE_STAMP: 2, Kind.SELF_EDGE: 1}, 2)


def test_known_edges_of_a_message_are_appended_and_the_rest_looked_at():
    buffer = PlainBuffer()
    message = batch(('map', 'a', 5), ('map', 'b', 5), ('map', 'c', 5))
    assert buffer.insert_batch(message) == []
    assert counts(buffer) == (3, {}, 4)
    later = batch(('map', 'a', 6), ('map', 'map', 6), ('map', 'c', 6))
    assert kinds(buffer.insert_batch(later)) == [Kind.SELF_EDGE]
    assert counts(buffer) == (5, {Kind.SELF_EDGE: 1}, 4)
    assert [(edge.child, edge.samples) for edge in buffer.edges()] == [
        ('a', 2), ('b', 1), ('c', 2)]


# --- old data, and runs that begin anew

@pytest.mark.parametrize(('options', 'why'), [
    ({}, f'{OLD}. For the first two set use_sim_time and publish /clock; or, if all edges jumped '
     'back, pass Buffer(clear_on_jump_back=...)'),
    ({'clear_on_jump_back': SECOND}, OLD),
    ({'now': HandClock(NOW - 20 * SECOND)},
     'The newest stamp of this edge is 20.000 s ahead of the clock: that stamp is wrong, and good '
     'data is refused until the clock reaches it. Buffer(max_future=...) refuses such stamps; '
     'clear() removes them')], ids=['plain', 'guarded', 'with a clock'])
def test_old_data_is_refused_with_the_likely_cause(options, why):
    buffer = PlainBuffer(**options)
    buffer.insert('map', 'base', NOW, Pose(), strict=False)
    (incident,) = buffer.insert('map', 'base', NOW - 10 * SECOND - 1, Pose(), strict=False)
    assert (incident.kind, incident.newest) == (Kind.OLD_DATA, NOW)
    assert incident.detail.endswith(f'. {why}')
    assert buffer.insert('map', 'base', NOW - 10 * SECOND, Pose(), strict=False) == []
    bad = buffer.insert('map', 'base', NOW, NAN, strict=False)
    assert OLD not in bad[0].detail


WAYS = {
    'insert': lambda buffer, stamp: buffer.insert(
        'map', 'base', stamp, Pose(), authority='me', strict=False),
    'batch': lambda buffer, stamp: buffer.insert_batch(batch(('map', 'base', stamp)), 'me'),
    'odd batch': lambda buffer, stamp: buffer.insert_batch(
        batch(('map', 'base', stamp, LONG)), 'me'),
    'track': lambda buffer, stamp: buffer.insert_track(
        'map', 'base', [stamp], [Pose()], authority='me', strict=False)}


@pytest.mark.parametrize('way', WAYS)
def test_new_run_clears_what_moves_and_ends_waits(way):
    buffer, log = watched(now=lambda: NOW, clear_on_jump_back=5 * SECOND)
    buffer.insert('base', 'camera', 0, Pose(), static=True)
    assert [WAYS[way](buffer, stamp) for stamp in (NOW, NOW - 9 * SECOND)] == [[], []]
    woken = []
    inquiry = Inquiry(buffer.waiting, lambda: buffer.lookup('map', 'base', 2 * NOW),
                      lambda: woken.append(1))
    assert inquiry.ask() is None
    begin = NOW - 8 * SECOND
    (remark,) = WAYS[way](buffer, begin)
    assert (remark.kind, remark.parent, remark.child, remark.stamp, remark.authority) == (
        Kind.JUMP_BACK, 'map', 'base', begin, 'me')
    assert log[-1] == [Kind.JUMP_BACK]
    assert counts(buffer) == (4, {Kind.JUMP_BACK: 1}, 3)
    assert {edge.child: edge.oldest for edge in buffer.edges()} == {
        'base': begin, 'camera': LATEST}
    assert woken
    with pytest.raises(ClockJumpException) as raised:
        inquiry.ask()
    assert str(raised.value) == ('During the wait all stamps went back, as in a bag that loops; '
                                 'the buffer was cleared')
    with pytest.raises(TransformException, match='all stamps went back, as in a bag that loops'):
        buffer.lookup('map', 'base', NOW - 9 * SECOND)


def test_remark_about_a_new_run_comes_before_the_incidents():
    buffer = PlainBuffer(clear_on_jump_back=5 * SECOND)
    for stamp in (NOW, NOW - 9 * SECOND):
        buffer.insert_batch(batch(('map', 'base', stamp)))
    got = buffer.insert_batch(batch(('map', 'base', NOW - 8 * SECOND), ('map', 'map', NOW
                                                                        - 8 * SECOND)))
    assert kinds(got) == [Kind.JUMP_BACK, Kind.SELF_EDGE]


@pytest.mark.parametrize(('clear', 'why'), [
    (lambda buffer: buffer.clear(), 'clear() was called'),
    (lambda buffer: buffer.start_anew('the robot was moved'), 'the robot was moved')],
    ids=['cleared', 'started anew'])
def test_clear_forgets_stamps_and_the_reading_of_the_clock(clear, why):
    clock = HandClock(NOW)
    buffer = PlainBuffer(now=clock, max_future=SECOND, clear_on_jump_back=5 * SECOND)
    buffer.insert('map', 'base', NOW, Pose())
    clock.now = 5 * SECOND
    clear(buffer)
    with pytest.raises(TransformException, match=why.replace('()', r'\(\)')):
        buffer.lookup('map', 'base')
    for stamp in (SECOND, 2 * SECOND, 3 * SECOND):
        assert buffer.insert('map', 'base', stamp, Pose()) == []
    assert kinds(buffer.insert('map', 'base', 7 * SECOND, Pose(), strict=False)) == [
        Kind.FAR_FUTURE]
    clock.now = SECOND
    buffer.intake.read_clock_anew()
    assert kinds(buffer.insert('map', 'base', 3 * SECOND, Pose(), strict=False)) == [
        Kind.FAR_FUTURE]


@pytest.mark.parametrize(('change', 'fails'), [
    (lambda buffer: buffer.clear(), False), (lambda buffer: buffer.start_anew('why'), True),
    (lambda buffer: buffer.remove_frame('base'), False),
    (lambda buffer: buffer.set_interpolation('base', Linear()), False)],
    ids=['cleared', 'started anew', 'removed', 'interpolated'])
def test_change_of_the_tree_asks_all_again(change, fails):
    buffer, woken = PlainBuffer(), []
    buffer.insert('map', 'base', 5, Pose())
    inquiry = Inquiry(buffer.waiting, lambda: buffer.lookup('map', 'base', 9),
                      lambda: woken.append(1))
    assert inquiry.ask() is None
    assert len(buffer.waiting) == 1
    change(buffer)
    assert woken == [1]
    if fails:
        with pytest.raises(ClockJumpException, match='^During the wait why; the buffer was clear'):
            inquiry.ask()
    else:
        assert inquiry.ask() is None


# --- the calls of a program

def test_options_have_defaults():
    assert PlainBuffer().cache_time == 10 * SECOND
    assert PlainBuffer(5 * SECOND).cache_time == 5 * SECOND
    assert PlainBuffer(0).cache_time == 0
    name = 'x' * 1024
    assert PlainBuffer().insert('map', name, 5, Pose()) == []
    assert kinds(PlainBuffer().insert('map', name + 'x', 5, Pose(), strict=False)) == [
        Kind.BAD_NAME]
    assert kinds(PlainBuffer(max_name_bytes=3).insert('map', 'base', 5, Pose(), strict=False)
                 ) == [Kind.BAD_NAME]
    small = PlainBuffer(max_frames=3)
    assert [kinds(small.insert('map', child, 5, Pose(), strict=False)) for child in 'abc'] == [
        [], [], [Kind.TOO_MANY_FRAMES]]
    large = PlainBuffer()
    samples = [Sample('map', str(number), 5, Pose()) for number in range(20_000)]
    assert kinds(large.insert_many(samples, strict=False)) == [Kind.TOO_MANY_FRAMES]


def test_live_buffer_advises_to_wait():
    for now, live in ((None, False), (lambda: NOW, True)):
        assert PlainBuffer(now=now).intake.tree.live is live


def test_authority_of_a_program_is_tf2s():
    buffer = PlainBuffer()
    buffer.insert('map', 'a', 5, Pose())
    buffer.insert_many([Sample('map', 'b', 5, Pose())])
    buffer.insert_track('map', 'c', [5], [Pose()])
    buffer.insert_batch(batch(('map', 'd', 5)))
    histories = buffer.intake.tree.histories
    assert [(histories[child].authority, histories[child].is_static) for child in 'abcd'] == [
        (AUTHORITY, False)] * 4


def test_buffer_is_not_copied():
    with pytest.raises(TypeError, match='a PlainBuffer cannot be pickled or copied'):
        copy.copy(PlainBuffer())


def test_frame_that_is_removed_was_known():
    buffer = PlainBuffer()
    buffer.insert('map', 'base', 5, Pose())
    assert [buffer.remove_frame('base'), buffer.remove_frame('base')] == [True, False]


def test_interpolation_is_of_a_frame_without_its_slash():
    class Held(Linear):
        """Holds the newest sample."""

        hold = 10

    buffer = PlainBuffer()
    buffer.set_interpolation('/base', Held())
    buffer.insert('map', 'base', 5, Pose(1.0))
    with pytest.raises(InvalidArgumentException):
        buffer.set_interpolation('base', 'Linear')
    with pytest.raises(InvalidArgumentException):
        buffer.set_interpolation('/', Held())


@pytest.mark.filterwarnings('error')
def test_strict_says_how_many_were_refused():
    buffer = PlainBuffer()
    samples = [Sample('map', child, 5, NAN if child in bad else Pose())
               for bad in ('a', 'abc') for child in 'abc']
    for part, more in ((samples[:3], ''), (samples[3:], ' (3 were refused)')):
        with pytest.raises(RefusedException) as raised:
            buffer.insert_many(part, strict=True)
        assert str(raised.value) == f'{raised.value.incidents[0]}{more}'
        assert len(raised.value.incidents) == (3 if more else 1)
    assert kinds(buffer.insert_many(samples, strict=False)) == [Kind.NOT_FINITE] * 4
    with pytest.warns(TransformWarning) as caught:
        buffer.insert_many(samples)
    assert len(caught) == 1
    buffer.insert_many(samples)


@pytest.mark.parametrize(('span', 'strict', 'warned'), [
    (10 * SECOND, None, 0), (10 * SECOND + 1, None, 1), (10 * SECOND + 1, True, 1),
    (10 * SECOND + 1, False, 0)])
def test_track_that_is_longer_than_the_window_is_warned_of(recwarn, span, strict, warned):
    buffer = PlainBuffer()
    for child in 'ab':
        assert buffer.insert_track(
            'map', child, np.array([0, span]) + 7, [Pose()] * 2, strict=strict) == []
    assert [str(each.message)[:29] for each in recwarn] == [
        "Samples of 'map' -> 'a' span "] * warned


def test_lookup_within_a_time_is_answered_or_gives_up():
    buffer = PlainBuffer()
    buffer.insert('map', 'base', 5, Pose(1.0))
    buffer.insert('map', 'base', 7, Pose(2.0))
    assert buffer.lookup_within(0.0, 'map', 'base') == Pose(2.0)
    assert buffer.lookup_within(0.0, 'map', 'base', np.int64(6)) == Pose(1.5)
    pose = buffer.wait_for(lambda: buffer.lookup('base', 'map', 5), WallDeadline(0.0))
    assert pose == Pose(-1.0)
    with pytest.raises(TransformException) as raised:
        buffer.lookup_within(0.0, 'map', 'base', 9)
    assert raised.value.waited_s is not None
