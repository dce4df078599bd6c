# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The presence of robots, by tokens, and by a clock that a test sets."""

import pytest
from tf_tree_py.fleet.roster import Presence, RETURN_S, SETTLE_S


class Clock:

    def __init__(self):
        self.seconds = 100.0

    def __call__(self):
        return self.seconds


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def presence(clock):
    presence = Presence(clock)
    presence.connect(True)
    return presence


def test_a_robot_has_come_with_its_first_token_and_gone_with_its_last(presence, clock):
    for token in 'ab':
        presence.see('robot7', token)
    assert presence.news() == [('robot7', True)]
    assert not presence.miss('robot7', 'a')
    clock.seconds += 10 * SETTLE_S
    assert presence.news() == []
    assert presence.miss('robot7', 'b')
    assert not presence.miss('robot7', 'b')
    assert presence.news() == []
    clock.seconds += SETTLE_S
    assert presence.news() == [('robot7', False)]
    presence.see('robot7', 'c')
    assert presence.news() == [('robot7', True)]


def test_a_robot_without_tokens_comes_with_its_data_and_stays(presence, clock):
    presence.see('robot7')
    assert presence.news() == [('robot7', True)]
    for connected in (False, True):
        presence.connect(connected)
        clock.seconds += 2 * RETURN_S
        assert presence.news() == []


@pytest.mark.parametrize('lost_first', [True, False])
def test_when_the_connection_is_lost_nobody_has_gone(presence, clock, lost_first):
    presence.see('robot7', 'a')
    presence.news()
    if lost_first:
        presence.connect(False)
    presence.miss('robot7', 'a')
    if not lost_first:
        presence.connect(False)
    clock.seconds += 100 * RETURN_S
    assert presence.news() == []
    presence.connect(True)
    presence.see('robot7', 'a')
    clock.seconds += 100 * RETURN_S
    assert presence.news() == []


def test_who_does_not_come_back_after_the_connection_did_has_gone(presence, clock):
    presence.see('robot7', 'a')
    presence.news()
    presence.miss('robot7', 'a')
    for connected in (False, True):
        presence.connect(connected)
    clock.seconds += RETURN_S - 0.1
    assert presence.news() == []
    clock.seconds += 0.1
    assert presence.news() == [('robot7', False)]


def test_a_token_that_comes_back_in_time_is_no_news(presence, clock):
    presence.see('robot7', 'a')
    presence.news()
    presence.miss('robot7', 'a')
    presence.see('robot7', 'b')
    clock.seconds += 10 * SETTLE_S
    assert presence.news() == []


def test_a_token_that_nobody_has_seen_is_no_news(presence, clock):
    presence.miss('robot7', 'a')
    clock.seconds += 10 * SETTLE_S
    assert presence.news() == []
