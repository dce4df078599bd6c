# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The rate limit of frames, checked with properties of any stream of samples."""

from collections import defaultdict
import itertools

from hypothesis import given, strategies as st
from tf_tree_py.core.messages.sample import Sample
from tf_tree_py.thinning import RateLimit

IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
PERIOD = 100


def sample(stamp, child='base'):
    return Sample('map', child, stamp, IDENTITY)


def test_first_after_a_pause_goes_at_once():
    pacing = RateLimit(PERIOD)
    assert pacing.next_turn is None
    assert pacing.offer([sample(1)], now=0) == [sample(1)]
    assert pacing.due(now=PERIOD) == []
    assert pacing.next_turn is None, 'a frame at rest costs nothing'
    assert pacing.offer([sample(2)], now=5000) == [sample(2)]


def test_newest_goes_when_it_is_due():
    pacing = RateLimit(PERIOD)
    pacing.offer([sample(1)], now=0)
    for stamp in (2, 4, 3):
        assert pacing.offer([sample(stamp)], now=10 * stamp) == []
    assert pacing.next_turn == PERIOD
    assert pacing.due(now=PERIOD - 1) == []
    assert pacing.due(now=PERIOD) == [sample(4)]
    assert pacing.next_turn == 2 * PERIOD


def test_sample_that_is_due_replaces_the_one_that_waits():
    pacing = RateLimit(PERIOD)
    pacing.offer([sample(1)], now=0)
    pacing.offer([sample(2)], now=1)
    assert pacing.offer([sample(3)], now=PERIOD) == [sample(3)]
    assert pacing.due(now=PERIOD) == []
    pacing.offer([sample(5)], now=PERIOD + 1)
    assert pacing.offer([sample(4)], now=2 * PERIOD) == [sample(5)]


def test_frames_do_not_wait_for_each_other():
    pacing = RateLimit(PERIOD)
    assert len(pacing.offer([sample(1, 'a'), sample(1, 'b')], now=0)) == 2
    assert pacing.offer([sample(2, 'a'), sample(2, 'c')], now=50) == [sample(2, 'c')]
    assert pacing.due(now=PERIOD) == [sample(2, 'a')]


def test_newest_of_a_frame_that_is_twice_in_a_message_goes():
    assert RateLimit(PERIOD).offer([sample(2), sample(1)], now=0) == [sample(2)]


# Steps of time, each with the frames that are offered then, and whether the thread that calls
# ``due`` was late.
steps = st.lists(st.tuples(
    st.integers(0, 150), st.lists(st.sampled_from('abc'), max_size=4), st.booleans()))


@given(steps)
def test_every_frame_goes_seldom_enough_and_its_last_sample_always(steps):
    pacing, now, last, gone = RateLimit(PERIOD), 0, {}, defaultdict(list)
    turns = {}

    def note(samples):
        for went in samples:
            gone[went.child].append((now, went.stamp))
            turns[went.child] = now + PERIOD
        assert pacing.next_turn == min(turns.values(), default=None)

    def go_on():
        for child in [child for child, turn in turns.items() if turn <= now]:
            del turns[child]
        note(pacing.due(now))

    for number, (step, children, late) in enumerate(steps):
        end = now + step
        while not late and pacing.next_turn is not None and pacing.next_turn <= end:
            now = max(now, pacing.next_turn)
            go_on()
        now = end
        note(pacing.offer([sample(number, child) for child in children], now))
        last.update(dict.fromkeys(children, number))
    while pacing.next_turn is not None:
        now = max(now, pacing.next_turn)
        go_on()
    assert gone.keys() == last.keys()
    for child, went in gone.items():
        times, stamps = zip(*went, strict=True)
        assert all(later - sooner >= PERIOD for sooner, later in itertools.pairwise(times))
        assert list(stamps) == sorted(set(stamps))
        assert stamps[-1] == last[child]
