# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Malicious frame names, long, many or odd: the limits of their cost and of their reports."""

from memory import bytes_of
import pytest
from tf_tree_py import BufferCore, LATEST, Pose, TransformException
from tf_tree_py.core import Incident, Kind, Sample
from tf_tree_py.core.buffer.plain_buffer import DEFAULT_MAX_NAME_BYTES
from tf_tree_py.core.messages.incidents import one_of
from tf_tree_py.core.messages.wire import DEFAULT_REMEMBERED, WireError, WireReader, write
from tf_tree_py.core.text import LONGEST_TEXT, shorten
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.reports.audit import LookupAudit

# More than any sentence about one transform needs, and far less than a name may have.
MOST_TEXT = 20_000
LONG = 'x' * 100_000


def test_sizes_are_those_of_what_is_kept():
    reader = WireReader()
    before = bytes_of(reader)
    reader.read(write([Sample('map', LONG, 1, Pose())]))
    assert bytes_of(reader) - before > 2 * len(LONG)


class Listening:
    """The parts of a listener: a reader, a buffer that is measured and observed, and counts."""

    def __init__(self, **options):
        self.buffer = BufferCore(clear_on_jump_back=10**9, **options)
        self.doctor = Doctor()
        self.buffer.observers.add(self.doctor)
        self.reader = WireReader()

    def hear(self, *samples):
        return self.buffer.insert_batch(self.reader.read(write(samples)), 'somebody')


# --- the limit

def test_name_beyond_the_limit_is_refused_alone():
    listening = Listening()
    told = listening.hear(Sample('map', 'a', 1, Pose()), Sample('map', LONG, 1, Pose()),
                          Sample(LONG, 'b', 1, Pose()), Sample('map', 'c', 1, Pose()))
    assert [incident.kind for incident in told] == [Kind.BAD_NAME] * 2
    assert 'it has 100000 bytes; the buffer accepts 1024 (max_name_bytes)' in told[0].detail
    assert listening.buffer.frames() == ['a', 'map', 'c']
    counts = listening.buffer.statistics()
    assert (counts.accepted, counts.refused, counts.incidents[Kind.BAD_NAME]) == (2, 2, 2)


@pytest.mark.parametrize('letter', ['x', 'é', '…', '🤖'])
def test_limit_is_exact_and_in_bytes(letter):
    buffer = BufferCore(max_name_bytes=12)
    size = len(letter.encode())
    assert buffer.insert('map', letter * (12 // size), 1, Pose()) == []
    (told,) = buffer.insert('map', letter * (12 // size) + 'x', 1, Pose())
    assert told.kind is Kind.BAD_NAME
    assert told.refused


@pytest.mark.parametrize(('name', 'words'), [
    ('a\0b', 'NUL'), ('\0', 'NUL'), ('a\ud800', 'UTF-8'), ('x' * 1025, '1025 bytes')])
@pytest.mark.parametrize('static', [False, True])
def test_name_that_no_message_can_carry_is_refused_on_either_end(name, words, static):
    buffer = BufferCore()
    for edge in (('map', name), (name, 'map')):
        (told,) = buffer.insert(*edge, 1, Pose(), static=static)
        assert told.kind is Kind.BAD_NAME
        assert words in told.detail
        str(told).encode()
    assert buffer.frames() == []


def test_snapshot_keeps_the_limit():
    buffer = BufferCore(max_name_bytes=3)
    assert buffer.intake.tree.copy().max_name_bytes == 3


# --- the reports

def test_whatever_is_told_of_long_names_is_short():
    buffer = BufferCore(now=lambda: 10**18, max_future=10**9, max_name_bytes=10**6,
                        clear_on_jump_back=10**9)
    nan = Pose()._replace(x=float('nan'))
    told = []
    long, other = LONG, LONG + 'y'
    for insert in [
            (long, other, 10**18, Pose(), long), (other, long, 10**18, Pose(), other),
            (long, long, 1, Pose(), long), (long, other, 1, nan, long),
            (long, other, 2 * 10**18, Pose(), long), (long, other, 1, Pose(), long),
            ('map', other, 10**18, Pose(), other), (LONG * 11, 'a', 1, Pose(), long)]:
        *transform, authority = insert
        told += buffer.insert(*transform, authority=authority)
        told += buffer.insert(*transform, authority=authority, static=True)
    assert len({incident.kind for incident in told}) >= 7
    for incident in told:
        for text in (str(incident), incident.detail, incident.child, repr(incident)):
            assert len(text) < MOST_TEXT
    moving = BufferCore(max_name_bytes=10**6)
    moving.insert(long, other, 10, Pose())
    for ask in (
            lambda: moving.lookup(long, other, 5), lambda: moving.lookup(other, long, 50),
            lambda: buffer.lookup(long, 'nobody'), lambda: buffer.lookup('map', LONG * 2),
            lambda: buffer.lookup(LONG * 2, 'map'), lambda: buffer.lookup('/' + long, 'map'),
            lambda: buffer.lookup(long, other, 5), lambda: buffer.lookup(long, 'map')):
        with pytest.raises(TransformException) as caught:
            ask()
        assert len(str(caught.value)) < MOST_TEXT
        assert len(repr(caught.value)) < MOST_TEXT


def test_loop_over_many_frames_is_told_in_short():
    buffer = BufferCore()
    for number in range(5_000):
        buffer.insert(f'frame{number}', f'frame{number + 1}', 1, Pose(), authority='somebody')
    (told,) = buffer.insert('frame5000', 'frame0', 1, Pose())
    assert told.kind is Kind.LOOP
    assert len(str(told)) < MOST_TEXT


def test_bytes_that_are_no_text_are_told_in_short():
    data = write([Sample('map', 'x' * 10**6, 1, Pose())]).replace(b'xxx', b'\xff\xff\xff')
    with pytest.raises(WireError, match='is not UTF-8') as caught:
        WireReader().read(data)
    assert len(str(caught.value)) < 1000


def test_many_candidates_are_told_in_short():
    assert one_of({'/b', '/a'}) == 'one of /a, /b'
    assert one_of([f'/n{number:03}' for number in range(1000)]).endswith('/n011 and 988 more')


@pytest.mark.parametrize('size', [0, 1, LONGEST_TEXT])
def test_short_text_stays(size):
    assert shorten('x' * size) == 'x' * size


def test_long_text_keeps_both_its_ends():
    assert shorten('a' * 50 + 'b' * 50, 10) == 'aaaaa... (100 characters) ...bbbbb'
    told = Incident(Kind.LOOP, 'map', 'odom', 1, 'me', 'begin' + LONG + 'end').detail
    assert told.startswith('begin')
    assert told.endswith('end')
    assert len(told) < LONGEST_TEXT + 100


# --- the cost

def long_names():
    """Yield different names; Python needs 4 bytes for each character of every second one."""
    for number in range(200):
        yield f'{number}{LONG}' + '🤖' * (number % 2)


@pytest.mark.parametrize('samples_of', [
    lambda name: [Sample('map', name, 1, Pose())],
    lambda name: [Sample(name, 'map', 1, Pose())],
    lambda name: [Sample(name, name, 1, Pose())],
    lambda name: [Sample('map', 'good', 1, Pose()), Sample('map', name, 1, Pose())],
    lambda name: [Sample('map', 'good', 1, Pose()), Sample(name, 'good', 1, Pose())],
], ids=['child', 'parent', 'both', 'beside', 'another parent'])
def test_messages_with_long_names_are_not_kept(samples_of):
    """Two hundred of 100 kB each: 20 MB, and twice or four times that as text."""
    listening = Listening()
    listening.hear(Sample('map', 'good', 1, Pose()))
    for name in long_names():
        listening.hear(*samples_of(name))
    assert bytes_of(listening.buffer, listening.doctor) < 2_000_000
    assert bytes_of(listening.reader) < 10_000_000


def test_long_messages_of_known_edges_are_not_kept():
    """The same two edges repeatedly, each time in another number."""
    listening = Listening()
    listening.reader = WireReader(most=DEFAULT_REMEMBERED // 10)
    for number in range(60):
        listening.hear(*[Sample('map', f'good{number % 2}', 1, Pose())] * (100 + number))
    samples = bytes_of(listening.buffer.intake.tree.histories)
    assert bytes_of(listening.buffer, listening.reader) - samples < 3_000_000


def test_who_fights_over_everything_is_not_kept_for_ever():
    """Every child under every parent: the number of pairs is the square of that of frames."""
    buffer = BufferCore()
    names = [f'frame{number}' for number in range(80)]
    for round_ in range(1, 80):
        for number, name in enumerate(names):
            buffer.insert(f'world{round_}', name, round_, Pose(), authority=f'node{number}')
            buffer.insert(f'map{round_}', name, round_, Pose(), authority='another')
    assert buffer.statistics().incidents[Kind.SECOND_PARENT] > 5_000
    samples = bytes_of(buffer.intake.tree.histories)
    assert bytes_of(buffer) - samples < 1_000_000


def test_paths_between_all_frames_are_not_kept_for_ever():
    buffer = BufferCore()
    names = [f'frame{number}' for number in range(200)]
    for name in names:
        buffer.insert('map', name, 1, Pose(), static=True)
    for target in names:
        for source in names:
            buffer.lookup(target, source, LATEST)
    assert bytes_of(buffer) < 15_000_000


def test_audit_of_strangers_lookups_is_short():
    buffer = BufferCore()
    audit = LookupAudit(buffer)
    buffer.observers.add(audit)
    for name in long_names():
        with pytest.raises(TransformException):
            buffer.lookup(name, 'map', LATEST)
    assert bytes_of(audit) < 1_000_000
    assert len(audit.lines()) == 200


def test_limit_of_names_bounds_what_a_full_buffer_keeps():
    buffer = BufferCore(max_frames=1_000)
    for number in range(3_000):
        buffer.insert('map', f'{number:08}'.rjust(DEFAULT_MAX_NAME_BYTES, 'x'), 1, Pose())
    assert buffer.statistics().frames == 1_000
    assert bytes_of(buffer) < 1_000 * (DEFAULT_MAX_NAME_BYTES + 3_000)
