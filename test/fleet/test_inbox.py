# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waiting messages are limited, stay in order, and are processed in fair turns."""

import threading

from hypothesis import given, strategies as st
from tf_tree_py.fleet.transform_decoder import Inbox

ROBOTS = st.sampled_from('abcd')
PUTS = st.tuples(ROBOTS, st.integers(0, 3_000))


@given(st.lists(PUTS | st.none(), max_size=200), st.lists(st.floats(0.0, 9.0), min_size=4))
def test_waiting_is_bounded_and_in_order(events, costs):
    inbox, numbers = Inbox(10_000, 25_000), iter(range(10_000))
    waiting, out = {robot: [] for robot in 'abcd'}, []
    for event in events:
        if event is None:
            if any(waiting.values()):
                robot, item = inbox.pop()
                assert item == waiting[robot].pop(0)
                out.append(item)
                inbox.charge(robot, costs[len(out) % len(costs)])
            continue
        robot, size = event
        number = next(numbers)
        waiting[robot].append((number, size))
        for dropped in inbox.put(robot, (number, size), size):
            waiting[dropped].pop(0)
        sizes = [sum(size + 500 for _, size in line) for line in waiting.values()]
        assert max(sizes) <= 10_000 and sum(sizes) <= 25_000
    while any(waiting.values()):
        robot, item = inbox.pop()
        assert item == waiting[robot].pop(0)
        inbox.charge(robot, 1.0)


@given(st.dictionaries(ROBOTS, st.floats(0.01, 5.0), min_size=2))
def test_robots_that_wait_get_equal_time_whatever_their_messages_cost(costs):
    inbox, served = Inbox(10**9), dict.fromkeys(costs, 0.0)
    for robot in costs:
        for number in range(1_000):
            inbox.put(robot, number, 1)
    for _ in range(500):
        robot, _ = inbox.pop()
        served[robot] += costs[robot]
        inbox.charge(robot, costs[robot])
    assert max(served.values()) - min(served.values()) <= max(costs.values()) + 1e-6


def test_robot_that_comes_is_served_next_though_another_has_much_waiting():
    inbox = Inbox(10**9)
    for number in range(1_000):
        inbox.put('evil', number, 1)
    for _ in range(10):
        assert inbox.pop()[0] == 'evil'
        inbox.put('good', 'news', 1)  # while the other is decoded
        inbox.charge('evil', 1.0)
        assert inbox.pop() == ('good', 'news')
        inbox.charge('good', 0.001)


def test_robot_that_was_away_has_saved_nothing_up():
    inbox = Inbox(10**9)
    inbox.put('away', 0, 1)
    inbox.charge(inbox.pop()[0], 0.1)
    for number in range(100):
        inbox.put('busy', number, 1)
        inbox.charge(inbox.pop()[0], 1.0)
    for number in range(10):
        inbox.put('away', number, 1)
        inbox.put('busy', number, 1)
    order = []
    for _ in range(10):
        order.append(inbox.pop()[0])
        inbox.charge(order[-1], 1.0)
    assert 4 <= order.count('busy') <= 6


def test_memory_of_all_is_taken_from_whoever_has_most():
    inbox = Inbox(10**9, 100_000)
    for number in range(20):
        inbox.put('good', number, 100)
    dropped = [robot for number in range(1_000) for robot in inbox.put('evil', number, 2_000)]
    assert set(dropped) == {'evil'}


def test_who_waits_for_a_message_gets_it_and_ends_with_the_inbox():
    inbox, taken = Inbox(10**9), []

    def work():
        while (one := inbox.pop()) is not None:
            taken.append(one)
            inbox.charge(one[0], 0.0)
            if len(taken) == 2:
                inbox.close()

    thread = threading.Thread(target=work)
    thread.start()
    inbox.put('a', 1, 1)
    inbox.put('a', 2, 1)
    thread.join()
    assert taken == [('a', 1), ('a', 2)] and inbox.pop() is None
