# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two publishers of one edge, detected by the numbers of their messages alone."""

from collections import Counter
import random

from hypothesis import given, strategies as st
from inputs import for_each
from memory import bytes_of
import pytest
from tf_tree_py.health.duplicate_streams import DuplicateStreams

ODOM, ARM, TOOL = ('odom', 'base'), ('base', 'arm'), ('arm', 'tool')


def reported_by(messages, static=False):
    """Return how often each edge was reported; a reported edge is marked."""
    streams, told = DuplicateStreams(static), Counter()
    for edges, number in messages:
        for edge in streams.examine(edges, number):
            told[edge] += 1
            streams.mark_reported(edge)
    return told


def publisher(edges, begin=1, count=100, step=1):
    return [(edges, number) for number in range(begin, begin + count * step, step)]


def in_turns(*publishers):
    return [message for messages in zip(*publishers, strict=True) for message in messages]


# --- two publishers

@for_each(begin=[1, 2, 5, 50, 90, 1000, 10**15], edges=[[ODOM], [ODOM, ARM], [ODOM, ARM, TOOL]])
def test_two_publishers_of_the_same_edges_are_told_of_once(edges, begin):
    # Of two streams in step only equal numbers fall back: with three edges, one pair in nine.
    both = in_turns(publisher(edges, count=400), publisher(edges, begin, count=400))
    assert reported_by(both) == Counter(edges)


@for_each(static=[False, True])
def test_message_whose_transforms_were_all_refused_has_no_edge(static):
    streams = DuplicateStreams(static)
    for edges in ([], [ODOM], []):
        assert not [*streams.examine(edges, 1)]


def test_three_publishers_are_told_of_once():
    assert reported_by(in_turns(*[publisher([ODOM], begin) for begin in (1, 500,
                                                                         9000)])) == {ODOM: 1}


def test_seldom_beside_often():
    often = publisher([ODOM], 7000, 1000)
    for place, number in enumerate(range(10, 20)):
        often.insert(90 * place + 50, ([ODOM], number))
    assert reported_by(often) == {ODOM: 1}


def test_edge_that_two_share_beside_others_of_their_own():
    both = in_turns(publisher([ODOM, ARM], 100, 300), publisher([TOOL, ODOM], 40, 300))
    assert reported_by(both) == {ODOM: 1}


def test_edge_in_every_other_message():
    """Two kinds of messages alternate: the numbers of one are even, of the other odd."""
    def sends(begin, other):
        return [([ODOM, ARM] if number % 2 else [other], number)
                for number in range(begin, begin + 400)]

    assert reported_by(in_turns(sends(0, TOOL), sends(1000, ('x', 'y')))) == {ODOM: 1, ARM: 1}


# --- one publisher

@pytest.mark.parametrize('messages', [
    publisher([ODOM, ARM]), publisher([ODOM], 5, 100, 7),
    in_turns(publisher([ODOM]), publisher([ARM])),
    in_turns(publisher([ODOM], 50), publisher([ARM], 1), publisher([TOOL], 10**9)),
], ids=['one', 'with losses', 'in lockstep', 'of different edges'])
def test_one_publisher_of_each_edge_is_no_two(messages):
    assert reported_by(messages) == {}


@pytest.mark.parametrize('lengths', [[100, 100], [300, 10, 5, 2, 1, 1, 1], list(range(1, 60)),
                                     [5] * 50, list(range(60, 1, -1))])
def test_publisher_that_is_restarted_is_no_two(lengths):
    """It was killed, so its end is not announced."""
    assert reported_by([message for length in lengths for message in publisher([ODOM], 1, length)]
                       ) == {}


def test_restarted_publisher_that_skips_past_where_others_ended_is_no_two():
    assert reported_by([message for length in range(10, 200, 7)
                        for message in publisher([ODOM], 1 + length % 3, length, 3)]) == {}


def test_publisher_that_dies_at_once_and_gets_lost_at_first_is_no_two():
    assert reported_by([([ODOM], number) for number in (1, 1, 2, 3, 2, 3, 4, 5)]) == {}


# Events on a topic: which publisher is next, and how many of its messages are lost before.
EVENTS = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 3)), max_size=300)
EDGES = st.lists(st.sampled_from([ODOM, ARM, TOOL]), min_size=1, unique=True)


@given(EVENTS, st.permutations([ODOM, ARM, TOOL]), st.tuples(*[st.integers(1, 50)] * 3))
def test_edges_of_one_publisher_are_never_reported(
        events, edges, begins):
    numbers, messages = list(begins), []
    for who, lost in events:
        numbers[who] += 1 + lost
        messages.append(([edges[who]], numbers[who]))
    assert reported_by(messages) == {}
    assert reported_by(messages, static=True) == {}


@given(st.tuples(EDGES, EDGES, EDGES), st.tuples(*[st.integers(1, 2000)] * 3),
       st.tuples(*[st.floats(0.5, 2.0)] * 3), st.floats(0.0, 0.3), st.integers())
def test_those_and_only_those_that_two_send_are_told_of(edges, begins, periods, loss, seed):
    """Three publishers, each at its own rate, whose messages get lost."""
    chance = random.Random(seed)
    sent = Counter(edge for each in edges for edge in each)
    arrivals = []
    for who in range(3):
        for tick in range(round(600 * max(periods) / periods[who])):
            if chance.random() >= loss:
                arrivals.append((tick * periods[who], who, begins[who] + tick))
    messages = [(edges[who], number) for _, who, number in sorted(arrivals)]
    assert reported_by(messages) == {edge: 1 for edge, senders in sent.items() if senders > 1}


# --- static edges

def test_static_edge_of_two_is_told_of_at_the_first_fall():
    assert reported_by([([ODOM, ARM], 1), ([TOOL, ODOM], 1)], static=True) == {ODOM: 1}
    assert reported_by([([ODOM], 3), ([ODOM], 2)], static=True) == {ODOM: 1}


def test_broadcaster_that_sends_all_again_with_every_new_edge_is_one():
    assert reported_by([([ODOM], 1), ([ODOM, ARM], 2), ([ODOM, ARM, TOOL], 3), ([ODOM, ARM], 9)],
                       static=True) == {}


# --- forgetting

@pytest.mark.parametrize('static', [False, True])
def test_who_left_is_forgotten(static):
    streams = DuplicateStreams(static)
    for _ in range(20):
        assert not streams.examine([ODOM], 5)
        streams.begin_anew()
        assert not streams.examine([ODOM], 3)
        streams.begin_anew()


def test_what_goes_on_after_another_left_is_told_again():
    streams = DuplicateStreams(static=True)
    streams.examine([ODOM], 5)
    assert list(streams.examine([ODOM], 3)) == [ODOM]
    assert list(streams.examine([ODOM], 2)) == [ODOM], 'until it is told'
    streams.mark_reported(ODOM)
    assert not any(streams.examine([ODOM], number) for number in (9, 8, 7))
    streams.begin_anew()
    assert any(streams.examine([ODOM], number) for number in (9, 8, 7))


def test_two_are_noticed_after_a_flood_of_names():
    flood = [([('map', f'{number}')], number) for number in range(20_000)]
    assert reported_by(flood + in_turns(publisher([ODOM]), publisher([ODOM], 50))) == {ODOM: 1}


def test_numbers_that_only_fall_are_not_kept():
    streams = DuplicateStreams(static=False)
    for number in range(20_000, 0, -1):
        streams.examine([ODOM], number)
    assert bytes_of(streams) < 10_000


@pytest.mark.parametrize('static', [False, True])
def test_memory_is_bounded_whatever_the_names(static):
    streams, chance = DuplicateStreams(static), random.Random(1)
    for number in range(300):
        for name in (str(number), 'x' * 100_000 + str(number), 'x' * 3_000_000 + str(number)):
            for _ in range(2):
                for edge in streams.examine([('map', name)], chance.randrange(100)):
                    streams.mark_reported(edge)
    for number in range(30_000):
        streams.examine([('map', f'{number}')], chance.randrange(100))
    assert bytes_of(streams) < 10_000_000
