# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The rules for single samples, batches and tracks, at their boundaries."""

from types import SimpleNamespace

from hypothesis import given, strategies as st
from inputs import for_each
import numpy as np
import pytest
from tf_tree_py.core import (
    Incident,
    InvalidArgumentException,
    Kind,
    PlainBuffer,
    Pose,
    Sample,
    UNLIMITED,
)
from tf_tree_py.core.edges.packed import pack_pose, unpack_pose
from tf_tree_py.core.messages.sample import (
    admitted,
    as_sec_nanosec,
    bad_name,
    Batch,
    checked,
    checked_frame,
    checked_track,
    Edges,
    impossible_stamp,
    ImpossibleStamp,
    message_stamp,
    SampleTrack,
    sound_poses,
)

NAN = float('nan')
UNIT = (1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8)
LONG = (1.0, 2.0, 3.0, 0.0, 0.0, 1.2, 1.6)
ZERO = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0)
SECOND = 10**9


# --- what callers pass

@for_each(parent=['map', '/map', '//map', '', '/'], child=['base', '/base', '//base', '', '/'],
          stamp=[-2**63, -1, 0, 2**63 - 1])
def test_one_slash_is_removed_from_each_name_of_a_sample(parent, child, stamp):
    sample = Sample(parent, child, stamp, UNIT)
    got = admitted(sample)
    assert got == Sample(parent[parent[:1] == '/':], child[child[:1] == '/':], stamp, UNIT)
    assert (got is sample) == (parent[:1] != '/' and child[:1] != '/')


@pytest.mark.parametrize('stamp', [np.int64(5), True, np.datetime64(5, 'ns')],
                         ids=['int64', 'bool', 'datetime64'])
def test_stamp_of_another_type_becomes_an_int(stamp):
    got = admitted(Sample('map', 'base', stamp, UNIT)).stamp
    assert (type(got), got) == (int, int(np.int64(stamp)))


@for_each(stamp=[-2**63 - 1, 2**63, 1.0, None])
def test_what_is_no_stamp_is_refused_at_once(stamp):
    with pytest.raises(InvalidArgumentException, match='Invalid argument stamp'):
        admitted(Sample('map', 'base', stamp, UNIT))


@for_each(names=[(None, 'base'), ('map', None), (b'map', 'base'), (1, 2)])
def test_names_of_a_sample_are_strings(names):
    with pytest.raises(InvalidArgumentException) as raised:
        admitted(Sample(*names, 5, UNIT))
    assert str(raised.value) == (
        f'Invalid argument: the frames {names[0]!r} and {names[1]!r} must be strings')


def test_child_frame_is_a_name_without_its_slash():
    assert [checked_frame(name) for name in ('base', '/base', '//base', 'a/b')] == [
        'base', 'base', '/base', 'a/b']
    for bad in ('', '/', None, 5, b'base'):
        with pytest.raises(InvalidArgumentException) as raised:
            checked_frame(bad)
        assert str(raised.value) == f'child must be the name of a frame, not {bad!r}'


# --- the stamps of messages

def message(sec, nanosec, parent='map', **rest):
    stamp = SimpleNamespace(sec=sec, nanosec=nanosec)
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp, frame_id=parent), **rest)


@pytest.mark.parametrize(('sec', 'nanosec', 'stamp'), [
    (0, 0, 0), (3, 4, 3_000_000_004), (-1, 999_999_999, -1),
    (np.int32(2**31 - 1), np.uint32(5), (2**31 - 1) * 10**9 + 5)],
    ids=['zero', 'small', 'negative', 'of numpy'])
def test_stamp_of_a_message_is_its_seconds_and_nanoseconds(sec, nanosec, stamp):
    got = message_stamp(message(sec, nanosec))
    assert (type(got), got) == (int, stamp)
    assert impossible_stamp(message(sec, nanosec)) is None


def test_nanoseconds_of_a_whole_second_are_impossible():
    assert impossible_stamp(message(7, 999_999_999)) is None
    assert impossible_stamp(message(7, 10**9, '/map', child_frame_id='//base')) == (
        'map', '/base', 7, 10**9)
    assert impossible_stamp(message(np.int32(7), np.uint32(2**32 - 1))) == (
        'map', '', 7, 2**32 - 1)
    # A Time of rclpy has no such field.
    time = SimpleNamespace(nanoseconds=5 * 10**9)
    assert impossible_stamp(SimpleNamespace(header=SimpleNamespace(stamp=time))) is None


def test_impossible_stamp_is_an_incident_that_says_why():
    assert ImpossibleStamp('map', 'base', -7, 10**9).incident('me') == Incident(
        Kind.IMPOSSIBLE_STAMP, 'map', 'base', -7 * 10**9, 'me',
        'header.stamp.nanosec is 1000000000 (sec is -7), and must be below a second, 1000000000: '
        'the node that stamps it computes it wrongly')


LAST_SEC = 2**31 - 1


@pytest.mark.parametrize(('stamp', 'pair'), [
    (0, (0, 0)), (-1, (-1, 999_999_999)), (5 * 10**9 + 6, (5, 6)),
    (-2**31 * 10**9, (-2**31, 0)), (-2**31 * 10**9 - 1, None),
    (LAST_SEC * 10**9, (LAST_SEC, 0)),
    (LAST_SEC * 10**9 + 999_999_999, (LAST_SEC, 999_999_999)),
    (LAST_SEC * 10**9 + 10**9, (LAST_SEC, 10**9)),
    (LAST_SEC * 10**9 + 2 * 10**9 + 3, (LAST_SEC, 2 * 10**9 + 3)),
    (LAST_SEC * 10**9 + 2**32 - 1, (LAST_SEC, 2**32 - 1)),
    (LAST_SEC * 10**9 + 2**32, None), (2**63 - 1, None), (-2**63, None)])
def test_stamps_of_messages_have_32_bits_of_each(stamp, pair):
    if pair is not None:
        assert as_sec_nanosec(stamp) == pair
        return
    with pytest.raises(InvalidArgumentException, match=r'^Invalid argument stamp -?\d+\.\d{9} s'):
        as_sec_nanosec(stamp)


# --- names

@pytest.mark.parametrize(('name', 'most', 'fault'), [
    ('base', 4, ''), ('base', 3, "'base': it has 4 bytes; the buffer accepts 3 (max_name_bytes)"),
    ('gr\u00fcn', 5, ''),
    ('gr\u00fcn', 4, "'gr\u00fcn': it has 5 bytes; the buffer accepts 4 (max_name_bytes)"),
    ('', 0, ''), ('a\0b', 3, "'a\\x00b': it contains a NUL, which ends every string in ROS"),
    ('\0', 1, "'\\x00': it contains a NUL, which ends every string in ROS"),
    ('\ud800', 100, "'\\ud800': it cannot be encoded in UTF-8"),
    ('x' * 58, 9, f"'{'x' * 58}': it has 58 bytes; the buffer accepts 9 (max_name_bytes)"),
    ('x' * 59, 9, f"'{'x' * 29}... (61 characters) ...{'x' * 29}': it has 59 bytes; the buffer "
     'accepts 9 (max_name_bytes)')])
def test_bad_name_is_an_incident_of_either_end(name, most, fault):
    for parent, child in ((name, ''), ('', name)):
        got = bad_name(parent, child, 7, 'me', most)
        assert got == (Incident(Kind.BAD_NAME, parent, child, 7, 'me', fault) if fault else None)


def test_parent_is_the_first_whose_name_is_bad():
    assert bad_name('\0', 'long', 7, 'me', 3).detail.startswith("'\\x00': ")
    assert bad_name('long', '\0', 7, 'me', 3).detail.startswith("'long': it has 4")


# --- numbers

def incident(kind, detail, parent='map', child='base'):
    return Incident(kind, parent, child, 7, 'me', detail)


@pytest.mark.parametrize(('parent', 'child', 'pose', 'expected'), [
    ('', '', UNIT, incident(Kind.EMPTY_FRAME, 'child_frame_id is not set', '', '')),
    ('', 'base', UNIT, incident(Kind.EMPTY_FRAME, 'header.frame_id is not set', '')),
    ('map', '', UNIT, incident(Kind.EMPTY_FRAME, 'child_frame_id is not set', child='')),
    ('base', 'base', UNIT, incident(
        Kind.SELF_EDGE, 'frame_id and child_frame_id are the same', 'base')),
    ('map', 'base', ZERO, incident(
        Kind.ZERO_ROTATION, 'was the message left unset? To send no rotation, set it to 0 0 0 1')),
    ('map', 'base', (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e400), incident(
        Kind.NOT_FINITE, '(x y z, qx qy qz qw) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, inf)')),
    ('map', 'base', (0.0, 0.0, 0.0, 1.3e308, 1.3e308, 0.0, 0.0), incident(
        Kind.NOT_FINITE, '(x y z, qx qy qz qw) = (0.0, 0.0, 0.0, 1.3e+308, 1.3e+308, 0.0, 0.0)')),
    ('map', 'base', (1.7e308, 1.7e308, 1.7e308, 0.0, 0.0, 0.0, 1.0),
     Sample('map', 'base', 7, (1.7e308, 1.7e308, 1.7e308, 0.0, 0.0, 0.0, 1.0))),
    ('map', 'base', UNIT, Sample('map', 'base', 7, UNIT))])
def test_sample_is_taken_or_refused_with_its_reason(parent, child, pose, expected):
    assert checked(Sample(parent, child, 7, pose), 'me') == expected


@for_each(place=range(3, 7), size=[-2.0, 1e-200, 1e200])
def test_quaternion_with_a_single_number_is_a_rotation(place, size):
    pose = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0]
    pose[place] = size
    got = checked(Sample('map', 'base', 7, tuple(pose)), 'me')
    pose[place] = 1.0 if size > 0.0 else -1.0
    assert (got[:3], got.pose) == (('map', 'base', 7), pytest.approx(tuple(pose)))


# Up to six poses are only compared; a larger message is normalised at once.
@for_each(count=[0, 1, 2, 6, 7, 8, 20])
def test_poses_of_a_message_are_made_sound_or_left_to_a_closer_look(count):
    sound = [pack_pose(float(number), *UNIT[1:]) for number in range(count)]
    assert sound_poses(sound) is sound
    for place in {0, count // 2, count - 1} & set(range(count)):
        for odd in (LONG, ZERO, (NAN, *UNIT[1:])):
            poses = sound.copy()
            poses[place] = pack_pose(*odd)
            got = sound_poses(poses)
            if count <= 6 or odd is not LONG:
                assert got is None
                continue
            assert [each for number, each in enumerate(got) if number != place] == [
                each for number, each in enumerate(sound) if number != place]
            assert unpack_pose(got[place]) == pytest.approx(UNIT)


# --- batches

BATCH = Batch([('a', 'b'), ('b', 'c'), ('c', 'd')], [1, 2, 3],
              [pack_pose(float(number), *UNIT[1:]) for number in range(3)], ['/a'],
              [ImpossibleStamp('x', 'y', 1, 10**9)])


def test_edges_of_each_layout_have_a_key_of_their_own():
    edges = [('a', 'b'), ('b', 'c')]
    one, other = Edges(edges), Edges(edges)
    assert one == other == tuple(edges)
    assert one.key is not other.key
    layouts = [Batch(each, (), ()).layout for each in (one, other, edges, tuple(edges))]
    assert layouts[0] is one.key
    assert layouts[1] is other.key
    assert layouts[2:] == [tuple(edges)] * 2
    assert [type(each) for each in layouts[2:]] == [tuple] * 2


def test_part_of_a_batch_keeps_what_does_not_belong_to_one_transform():
    assert BATCH.part([2, 0]) == Batch(
        [('c', 'd'), ('a', 'b')], [3, 1], [BATCH.poses[2], BATCH.poses[0]], ['/a'],
        BATCH.impossible)
    assert BATCH.part([]) == Batch([], [], [], ['/a'], BATCH.impossible)


def test_parts_of_a_batch_end_with_its_impossible_stamps():
    parts = list(BATCH.parts(2))
    assert parts == [Batch(BATCH.edges[:2], [1, 2], BATCH.poses[:2]),
                     Batch(BATCH.edges[2:], [3], BATCH.poses[2:]),
                     Batch((), (), (), (), BATCH.impossible)]
    assert list(BATCH._replace(impossible=()).parts(3)) == [Batch(*BATCH[:3])]
    assert list(Batch((), (), ()).parts(3)) == []


def test_samples_of_a_batch_are_its_columns_side_by_side():
    assert BATCH.samples() == [
        Sample('a', 'b', 1, (0.0, *UNIT[1:])), Sample('b', 'c', 2, (1.0, *UNIT[1:])),
        Sample('c', 'd', 3, (2.0, *UNIT[1:]))]


# --- tracks

def track_of(stamps, poses=None):
    poses = np.array([(float(number), *UNIT[1:]) for number in range(len(stamps))]
                     if poses is None else poses).reshape(-1, 7)
    return SampleTrack('map', 'base', np.array(stamps, dtype=np.int64), poses)


def test_track_gives_its_samples_by_number():
    track = track_of([5, 3, 9])
    samples = [Sample('map', 'base', stamp, (float(number), *UNIT[1:]))
               for number, stamp in enumerate([5, 3, 9])]
    assert track.samples() == samples
    assert [track.samples(begin) for begin in range(4)] == [
        samples, samples[1:], samples[2:], []]
    assert [track.sample(number) for number in range(3)] == samples
    assert {type(number) for sample in track.samples() for number in sample.pose} == {float}
    assert type(track.sample(0).stamp) is int


@pytest.mark.parametrize(('stamps', 'span', 'earliest'), [
    ([], 0, []), ([7], 0, [7]), ([5, 3, 9], 6, [3, 3, 9]), ([9, 1, 4, 2], 8, [1, 1, 2, 2]),
    ([-2**63, 2**63 - 1], 2**64 - 1, [-2**63, 2**63 - 1])])
def test_track_knows_its_span_and_what_follows(stamps, span, earliest):
    track = track_of(stamps)
    assert (track.span, track.earliest_after().tolist()) == (span, earliest)


def test_track_that_a_buffer_does_not_keep_says_so():
    assert track_of([5 * SECOND, 3 * SECOND]).gone(SECOND) == (
        "Samples of 'map' -> 'base' span 2.000 s, and the buffer keeps 1.000 s: older samples "
        'were dropped. cache_time=UNLIMITED keeps everything')


def test_judged_track_knows_what_is_refused_from_a_number_on():
    judged = track_of([1, 2, 3, 4], [UNIT, ZERO, LONG, (NAN, *UNIT[1:])]).judged('me')
    zero, nan = (checked(judged.track.sample(number), 'me') for number in (1, 3))
    assert judged.good.tolist() == [True, False, True, False]
    assert list(judged.refused) == [1, 3]
    # NaN equals nothing, so the text of the incident is compared.
    assert [str(each) for each in judged.refused.values()] == [str(zero), str(nan)]
    for number, stamps, refused in ((0, [1, 3], [zero, nan]), (1, [3], [zero, nan]),
                                    (2, [3], [nan]), (3, [], [nan]), (4, [], [])):
        rest, incidents = judged.after(number)
        assert (rest.parent, rest.child, rest.stamps.tolist()) == ('map', 'base', stamps)
        assert list(map(str, incidents)) == list(map(str, refused))
        assert rest.poses.tolist() == [pytest.approx(UNIT)] * len(stamps)
    sound = track_of([1, 2]).judged('me')
    assert [sound.after(number)[0].stamps.tolist() for number in range(3)] == [[1, 2], [2], []]
    assert sound.after(0)[1] == []


@pytest.mark.parametrize(('window', 'latest', 'stamps', 'within'), [
    (10, 100, [], True), (10, 100, [90], True), (10, 100, [89], False), (10, 100, [200], True),
    (10, 100, [95, 105], True), (10, 100, [95, 106, 96], True), (10, 100, [95, 106, 95], False),
    (10, 100, [111, 101], True), (10, 100, [111, 100], False), (10, 100, [200, 100], False),
    (0, 100, [100], True), (0, 100, [101, 100], False), (0, 100, [101, 102], True),
    (UNLIMITED, 2**63 - 1, [-2**63], True), (UNLIMITED, -2**63, [2**63 - 1, -2**63], True),
    # The window of these does not fit into 64 bits: such samples are inserted one by one.
    (2**63, 2**63 - 1, [-1], True), (2**63, 2**63 - 1, [-2], False),
    (2**63 - 1, 2**63 - 1, [0], True), (2**63 - 1, 2**63 - 1, [-1], False),
    (10, -2**63 + 5, [-2**63], True), (10, -2**63, [-2**63 + 10, -2**63], True),
    (10, -2**63, [-2**63 + 11, -2**63], False), (10, -2**63, [-2**63 + 30, -2**63 + 21], True)])
def test_samples_are_within_the_window_when_they_arrive(window, latest, stamps, within):
    buffer = PlainBuffer(10**9)
    buffer.insert('map', 'base', latest, Pose())
    history = buffer.intake.tree.histories['base']
    history.cache_time = window
    assert track_of(stamps).is_within(history) is within


@given(st.integers(1_000_000, 1_000_020), st.lists(st.integers(0, 2_000_010), max_size=6))
def test_track_is_within_if_each_of_its_samples_is(window, stamps):
    buffer = PlainBuffer(window)
    buffer.insert('map', 'base', 1_000_000, Pose())
    newest, within = 1_000_000, True
    for stamp in stamps:
        within = within and stamp >= newest - window
        newest = max(newest, stamp)
    assert track_of(stamps).is_within(buffer.intake.tree.histories['base']) is within


@pytest.mark.parametrize(('parent', 'child', 'count', 'poses', 'error'), [
    (None, 'base', 1, [UNIT], 'parent is the name of a frame, not None'),
    ('map', 7, 1, [UNIT], 'child is the name of a frame, not 7'),
    ('map', 'base', 2, [UNIT], 'there must be one pose (N, 7) for each stamp (N,): not 2 stamps '
     'and 1 poses'),
    ('map', 'base', 0, [UNIT], 'there must be one pose (N, 7) for each stamp (N,): not 0 stamps '
     'and 1 poses'),
    ('map', 'base', 1, [UNIT, UNIT], 'there must be one pose (N, 7) for each stamp (N,): not 1 '
     'stamps and 2 poses')])
def test_track_of_other_arguments_is_refused(parent, child, count, poses, error):
    with pytest.raises(InvalidArgumentException) as raised:
        checked_track(parent, child, np.arange(count), poses)
    assert str(raised.value) == error


def test_track_has_names_without_a_slash_and_an_array_of_poses():
    track = checked_track('/map', '//base', np.array([4, 5]), [UNIT, LONG])
    assert track[:2] == ('map', '/base')
    assert track.stamps.tolist() == [4, 5]
    assert track.poses.tolist() == [list(UNIT), list(LONG)]
    for nothing in ([], np.empty((0, 7)), ()):
        empty = checked_track('map', 'base', np.array([], dtype=np.int64), nothing)
        assert (empty.stamps.shape, empty.poses.shape) == ((0,), (0, 7))
