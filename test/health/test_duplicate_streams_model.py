# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The numbers of messages sorted into streams, compared with a slow and simple version."""

from hypothesis import given, strategies as st
from tf_tree_py.health.duplicate_streams import DuplicateStreams

EDGE, OTHER = ('a', 'b'), ('c', 'd')
LIMIT = 2_000_000


class Streams:
    """Streams of one edge: their last numbers, that with the latest message at the end."""

    def __init__(self):
        self.lasts, self.returns = [], 0

    def add(self, number):
        """
        Add a number; return whether numbers have fallen back three times.

        A number that only continues the current stream is not judged.
        """
        below = [last for last in self.lasts if last < number]
        current = self.lasts[-1] if self.lasts else None
        if below and max(below) != current:
            self.lasts.remove(max(below))
            self.returns += number <= current
        elif below:
            self.lasts[-1] = number
            return False
        self.lasts = [*self.lasts, number][-9:]
        return self.returns >= 3


# Numbers of up to three publishers, and of more streams than are kept.
NUMBERS = st.one_of(
    st.lists(st.integers(1, 12), max_size=40),
    st.lists(st.sampled_from([*range(5, 100, 9), *range(6, 100, 9)]), max_size=60),
    st.permutations(range(1, 16)).map(lambda numbers: [*range(100, 0, -10), *numbers, 3, 2, 7]))


@given(NUMBERS)
def test_edge_is_contested_as_soon_as_numbers_fell_back_three_times(numbers):
    streams, model = DuplicateStreams(static=False), Streams()
    for place, number in enumerate(numbers):
        assert list(streams.examine([EDGE], number)) == [EDGE] * model.add(number), (
            numbers[:place + 1])


@given(st.lists(st.integers(1, 12), max_size=20))
def test_static_edge_is_contested_by_every_number_that_falls(numbers):
    streams, last = DuplicateStreams(static=True), 0
    for number in numbers:
        assert list(streams.examine([EDGE], number)) == [EDGE] * (number <= last)
        last = number


def test_nine_streams_are_kept():
    for count in (9, 10):
        streams, model = DuplicateStreams(static=False), Streams()
        # The first stream is continued only if it was kept; then the others are, one by one.
        numbers = [*range(100 * count, 0, -100), 100 * count + 1, 301, 202, 103]
        found = [bool(streams.examine([EDGE], number)) for number in numbers]
        assert found == [model.add(number) for number in numbers]
        assert found[-1]


def filled(streams, edges):
    for edge in edges:
        assert not list(streams.examine([edge], 5))


def is_known(streams, edge):
    """Return whether the number of a static edge is known; one of none has not fallen."""
    return list(streams.examine([edge], 5)) == [edge]


def named(characters):
    """Return an edge that takes as much memory as this many characters."""
    return 'p' * (characters - 300 - 1000), 'c' * 1000


def test_memory_is_limited_to_two_million_characters():
    streams = DuplicateStreams(static=True)
    filled(streams, [EDGE, named(LIMIT - 302)])
    assert is_known(streams, EDGE)
    filled(streams, [OTHER])
    assert is_known(streams, OTHER)
    # With the other one it has begun anew.
    assert not is_known(streams, EDGE)
    filled(streams, [named(LIMIT - 604)])
    assert is_known(streams, OTHER)
    assert is_known(streams, EDGE)


def test_one_character_more_is_too_much():
    streams = DuplicateStreams(static=True)
    filled(streams, [EDGE, named(LIMIT - 301)])
    assert not is_known(streams, EDGE)
    one = named(LIMIT)
    streams = DuplicateStreams(static=True)
    filled(streams, [one])
    assert is_known(streams, one)
    one = named(LIMIT + 1)
    filled(streams, [one])
    assert not is_known(streams, one)
    assert streams.is_empty


def test_those_that_were_reported_are_forgotten_with_the_others():
    streams = DuplicateStreams(static=True)
    filled(streams, [EDGE])
    streams.mark_reported(EDGE)
    assert not is_known(streams, EDGE)
    filled(streams, [named(LIMIT)])
    filled(streams, [EDGE])
    assert is_known(streams, EDGE)


def test_beginning_anew_frees_the_memory():
    streams = DuplicateStreams(static=True)
    assert streams.is_empty
    filled(streams, [EDGE, OTHER])
    assert not streams.is_empty
    streams.begin_anew()
    assert streams.is_empty
    filled(streams, [EDGE, named(LIMIT - 302)])
    assert is_known(streams, EDGE)
