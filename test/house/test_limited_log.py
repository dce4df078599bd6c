# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The limited log: few lines under any flood, and the counts of all others."""

from bisect import bisect_left
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
import random
import re
from types import SimpleNamespace

from hand_clock import clock_of_logs
from memory import bytes_of
import pytest
from tf_tree_py import Incident
from tf_tree_py.core import Kind
from tf_tree_py.limited_log import FailureLog, IncidentLog, LimitedLog

REFUSED = "Refused transform 'map' -> 'odom' from '/somebody' "
OLD, ITSELF = (f'({kind.value}): because' for kind in (Kind.OLD_DATA, Kind.SELF_EDGE))
MILLISECOND = 1 / 1024  # about that, and exact in binary
COUNT = re.compile(r'(\d+) more (?:of this kind|like this)')


@pytest.fixture
def clock(monkeypatch):
    return clock_of_logs(monkeypatch)


@pytest.fixture
def lines():
    return []


@pytest.fixture
def log(lines, clock):
    return LimitedLog(lines.append)


@pytest.fixture
def incident_log(lines, clock):
    return IncidentLog(SimpleNamespace(warning=lines.append))


def kept_by(log, lines):
    """Return the memory of a log, in bytes, without the lines that it has written."""
    return bytes_of(log) - bytes_of(lines)


def kept_when_empty(log, lines, clock):
    """Return the memory of a log that has forgotten what it wrote."""
    log.write('once', '', 'x')
    clock.now += 25.0
    log.write_counts()
    lines.clear()
    return kept_by(log, lines)


def incident(kind=Kind.OLD_DATA, child='odom', authority='/somebody'):
    return Incident(kind, 'map', child, 1, authority, 'because')


def told(lines):
    """Return how many messages some lines stand for: those written, and those counted."""
    lines = list(lines)
    alone = sum(re.match(r'\d+ more like this', line) is not None for line in lines)
    return len(lines) - alone + sum(int(count) for line in lines for count in COUNT.findall(line))


# --- one kind and one sender

def test_a_line_a_second_with_the_count_of_the_others(log, lines, clock):
    for number in range(2500):
        log.write('bad', '/a', f'message {number}', f'edge {number}')
        clock.now += MILLISECOND
    assert lines == ['message 0',
                     "message 1024 (1023 more of this kind from '/a' in 1.0 s, such as edge 1; "
                     'edge 2; edge 3; edge 4; edge 5)',
                     "message 2048 (1023 more of this kind from '/a' in 1.0 s, such as edge 1025; "
                     'edge 1026; edge 1027; edge 1028; edge 1029)']
    clock.now += 0.9
    log.write_counts()
    assert len(lines) == 3, 'the flood may go on'
    clock.now += 0.125
    log.write_counts()
    assert lines[3:] == ["451 more like this from '/a': bad, in 1.5 s, such as edge 2049; "
                         'edge 2050; edge 2051; edge 2052; edge 2053']
    assert told(lines) == 2500
    clock.now += 60.0
    log.write_counts()
    assert len(lines) == 4


def test_count_is_a_line_too_so_the_next_comes_a_second_later(log, lines, clock):
    for _ in range(2):
        log.write('bad', '/a', 'x', 'edge')
    clock.now += 1.0
    log.write_counts()
    log.write('bad', '/a', 'other', 'another edge')
    assert len(lines) == 2
    clock.now += 1.0
    log.write('bad', '/a', 'third', 'third edge')
    assert lines[2].startswith("third (1 more of this kind from '/a' in 1.0 s")


def test_same_subject_is_repeated_after_ten_seconds_and_others_come_between(
        incident_log, lines, clock):
    for _ in range(50):
        incident_log.report([incident(), incident(Kind.SELF_EDGE), incident(child='base')])
        clock.now += 0.2
        incident_log.write_counts()
    assert [line.partition(' (')[0] for line in lines] == [
        REFUSED.strip(), REFUSED.strip(), REFUSED.strip().replace('odom', 'base')]
    assert OLD in lines[0] and ITSELF in lines[1] and OLD in lines[2]
    incident_log.report([incident()])
    assert len(lines) == 4
    assert lines[3].startswith(REFUSED + OLD)
    old = [line for line in lines if OLD in line]
    assert told(old) == 2 * 50 + 1


def test_each_subject_waits_for_its_own_ten_seconds(log, lines, clock):
    for when, about in ((0.0, 'b'), (9.5, 'a'), (10.75, 'a'), (12.0, 'b'), (19.75, 'a')):
        clock.now = 1000.0 + when
        log.write('bad', '/a', f'{about} at {when}', about)
    assert [line.partition(' (')[0] for line in lines] == [
        'b at 0.0', 'a at 9.5', 'b at 12.0', 'a at 19.75']


def test_count_alone_waits_for_ten_seconds_also_after_a_pause(log, lines, clock):
    times = []
    for tick in range(200):
        clock.now = 1000.0 + 0.125 * tick
        if tick in (0, 64, 84, 93):
            log.write('bad', '/a', 'x', 'edge')
        log.write_counts()
        times += (len(lines) - len(times)) * [0.125 * tick]
    alone = [when for when, line in zip(times, lines, strict=True) if 'like this' in line]
    assert alone == [9.0, 19.0]


def test_slow_repetitions_are_counted_alone_at_most_once_in_ten_seconds(log, lines, clock):
    for _ in range(40):
        log.write('bad', '/a', 'the line', 'edge')
        clock.now += 2.0
        log.write_counts()
    assert len(lines) == 16, 'a line, and a count, in each of eight periods'
    assert sum(line.startswith('the line') for line in lines) == 8


def test_kinds_and_senders_do_not_hide_each_other(log, lines, clock):
    for kind in ('NaN', 'loop'):
        for sender in ('/a', '/b', ''):
            for _ in range(100):
                log.write(kind, sender, f'{kind} {sender}')
    assert lines == ['NaN /a', 'NaN /b', 'NaN ', 'loop /a', 'loop /b', 'loop ']
    clock.now += 1.0
    log.write_counts()
    assert len(lines) == 12 and told(lines) == 600
    assert "99 more like this from '/b': loop, in 1.0 s" in lines
    assert '99 more like this: NaN, in 1.0 s' in lines


def test_text_is_made_for_lines_only(log, lines, clock):
    made = []

    def text():
        made.append(1)
        return 'x' * 20_000

    assert [log.write('bad', '/a', text) for _ in range(100)] == [True] + 99 * [False]
    assert len(made) == 1
    assert len(lines[0]) < 10_100, 'a sender may choose any text'


def test_names_of_a_sender_stay_short_and_on_their_line(log, lines, clock):
    for number in range(3):
        log.write('bad', 'n' * 5000, 'x', f'\x1b[31m{number}\r\n[ERROR] forged')
        log.write('bad', 'n' * 5000, 'x', f'{number}' * 5000)
    clock.now += 1.0
    log.write_counts()
    assert len(lines[1]) < 800 and lines[1].isprintable() and 'forged' not in lines[1]


def test_text_of_a_sender_stays_on_its_line(log, lines, clock):
    log.write('bad', '/a', 'frame a\r\n[ERROR] forged \x1b[31m', 'edge')
    log.write('worse', '/a', ['one', 'two \x1b[31m\n[ERROR] forged'], 'edge')
    assert lines == ['frame a [ERROR] forged \\x1b[31m', 'one\ntwo \\x1b[31m [ERROR] forged']


def test_name_of_any_length_is_neither_kept_nor_written(log, lines, clock):
    for number in range(30):
        log.write('bad', f'{number}' + 'n' * 1_000_000, 'x')
    clock.now += 1.0
    log.write_counts()
    assert max(map(len, lines)) < 1000
    assert kept_by(log, lines) < 30_000


def test_news_are_repeated_after_a_second(log, lines, clock):
    for _ in range(8):
        log.write('connected', '/a', 'connected', None)
        clock.now += 0.5
    assert lines == ['connected', *3 * ["connected (1 more of this kind from '/a' in 1.0 s)"]]


# --- many senders

def test_senders_beyond_ten_are_counted_together(log, lines, clock):
    empty = kept_when_empty(log, lines, clock)
    for number in range(10_000):
        log.write('bad', f'/r{number}', f'line {number}')
        clock.now += MILLISECOND
    # In the first second, a line for each of ten, and one for all others; then one a second.
    assert lines[:11] == [f'line {number}' for number in range(11)]
    assert len(lines) == 11 + 9
    assert lines[11] == ('line 1034 (1023 more of this kind from others than the 10 senders '
                         "named in 1.0 s, such as '/r11'; '/r12'; '/r13'; '/r14'; '/r15')")
    assert kept_by(log, lines) < 30_000
    clock.now += 2.0
    log.write_counts()
    assert told(lines) == 10_000
    clock.now += 20.0
    log.write_counts()
    assert kept_by(log, lines) == empty, 'nothing stays behind'


def test_other_senders_take_the_places_of_those_that_are_silent_for_ten_seconds(clock):
    seconds = Counter()
    log = LimitedLog(lambda line: seconds.update([int(clock.now - 1000.0)]))
    for number in range(35 * 1024):
        log.write('bad', f'/r{number}', f'line {number}')
        clock.now += MILLISECOND
    assert seconds == {second: 1 if second % 10 else 11 for second in range(35)}


def test_senders_that_are_silent_make_room_also_where_nothing_ticks(log, lines, clock):
    empty = kept_when_empty(log, lines, clock)
    for turn in range(3):
        for number in range(10):
            for _ in range(2):
                log.write('bad', f'/{turn} {number}', 'x')
        clock.now += 25.0
    names = [line for line in lines if line == 'x']
    assert len(names) == 20 + 1, 'the counts are written first, and take a turn'
    log.write_counts()
    clock.now += 25.0
    log.write_counts()
    assert told(lines) == 60 and kept_by(log, lines) == empty


@pytest.mark.parametrize(('seed', 'senders'), [(1, 5), (2, 10), (3, 11), (4, 50), (5, 5000)])
def test_no_flood_takes_more_than_a_line_a_second_and_loses_no_count(lines, clock, seed, senders):
    rng, sent, begin = random.Random(seed), Counter(), clock.now
    written = defaultdict(list)

    def put(line):
        lines.append(line)
        written[re.search('kind [AB]', line).group()].append((clock.now, line))

    log = LimitedLog(put)
    while clock.now < begin + 100.0:
        clock.now += rng.expovariate(rng.choice([10.0, 1000.0]))
        if rng.random() < 0.001:
            clock.now += rng.uniform(0.0, 15.0)
        if rng.random() < 0.01:
            log.write_counts()
            assert bytes_of(log) < 100_000
            continue
        kind, sender = f'kind {rng.choice("AB")}', f's{rng.randrange(senders)}'
        log.write(kind, sender, f'{kind} from {sender!r}', str(rng.randrange(30)))
        sent[kind] += 1
    for _ in range(12):
        clock.now += 1.0
        log.write_counts()
    for kind, times in written.items():
        assert told(line for _, line in times) == sent[kind]
        of_sender = defaultdict(list)
        for when, line in times:
            of_sender[re.search("from '?([^',:(]+)", line).group(1)].append(when)
        assert most_in_a_second(when for when, _ in times) <= min(11, senders)
        if senders <= 10:
            assert {most_in_a_second(each) for each in of_sender.values()} == {1}


def most_in_a_second(times):
    times = sorted(times)
    return max(bisect_left(times, first + 1.0) - place for place, first in enumerate(times))


# --- loggers, threads

def test_line_of_a_dying_logger_does_not_hold_up_the_next(clock):
    log = IncidentLog(SimpleNamespace())
    with pytest.raises(AttributeError):
        log.report([incident()])
    log.report([incident()])


def test_threads_that_report_at_once_lose_no_count(incident_log, lines, clock):
    with ThreadPoolExecutor() as threads:
        list(threads.map(
            lambda _: [incident_log.report([incident()]) for _ in range(500)], range(4)))
    assert len(lines) == 1
    clock.now += 11.0
    incident_log.report([incident()])
    assert "(1999 more of this kind from '/somebody' in 11.0 s" in lines[1]


def test_another_logger_keeps_the_counts(incident_log, lines, clock):
    incident_log.report([incident(), incident()])
    others = []
    incident_log.logger = SimpleNamespace(warning=others.append)
    clock.now += 1.0
    incident_log.write_counts()
    assert len(lines) == 1 and told(others) == 1


def test_exceptions_of_one_class_are_one_kind_whatever_their_texts(lines, clock):
    log = FailureLog(lines.append)
    for number in range(1000):
        try:
            raise (ValueError if number % 2 else KeyError)(f'bad {number}')
        except (LookupError, ValueError):
            log.report('a callback', '/a', ' A hint.')
    assert len(lines) == 2
    assert lines[0].startswith('a callback failed:\nTraceback') and 'bad 0' in lines[0]
    assert lines[0].endswith(' A hint.')
    clock.now += 1.0
    log.write_counts()
    assert lines[3] == ("499 more like this from '/a': a callback failed with ValueError, in "
                        '1.0 s, such as ValueError: bad 3; ValueError: bad 5; ValueError: bad 7; '
                        'ValueError: bad 9; ValueError: bad 11')
