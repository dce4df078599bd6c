# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a publisher still keeps arrives, also if the router dies while it is being requested."""

import json
import subprocess
import sys
import threading
from types import SimpleNamespace

from conditions import until
from fleet_helpers import message, robot_of, Router, SECOND, send_first, session_at, x_of
from held_link import HeldLink
from programs import PATIENCE_S
import pytest
from tf_tree_py.core import UNLIMITED
from tf_tree_py.fleet import FleetListener, requests as requesting, RobotPublisher, RobotQuota
from tf_tree_py.fleet.requests import Gap, Requests
from tf_tree_py.fleet.roster import RobotCounts, Roster
from zenoh import handlers

NOW = 1_700_000_000 * SECOND
WIDE = RobotQuota(messages_per_s=1e6, bytes_per_s=1e9, waiting_bytes=10**9, decoding_share=100)
# More messages of 40 kB than a held link and the sender's queue take.
MANY = 400
LONG = [('map', f'{edge:_>900}', 0) for edge in range(40)]
# With so long a lease, no side closes the held link, however long a busy machine holds it. An
# answer to a router that is gone still delays all others, for the time that is Zenoh's default.
PATIENT = {'link': {'tx': {'lease': 600_000}}}


# In a process of its own: the sessions of a process share Zenoh's threads, so a robot whose answer
# waits for its link would stop the listener that is to empty it.
_ROBOT = """
import sys
from tf_tree_py.fleet import configuration, open_session, RobotPublisher
session = open_session(configuration(sys.argv[1], sys.argv[2]), float(sys.argv[4]))
robot = RobotPublisher(session, 'robot7', history=int(sys.argv[3]))
for line in sys.stdin:
    robot.send(bytes.fromhex(line))
    print('sent', flush=True)
"""


class FarRobot:
    """The robot ``robot7`` in a process of its own."""

    robot = 'robot7'

    def __init__(self, endpoint, config, history):
        self._process = subprocess.Popen(
            [sys.executable, '-c', _ROBOT, endpoint, str(config), str(history), str(PATIENCE_S)],
            text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def send(self, data):
        self._process.stdin.write(data.hex() + '\n')
        self._process.stdin.flush()
        assert self._process.stdout.readline() == 'sent\n'

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.communicate()


def large(number):
    """Return a message of 40 kB, because of its long names."""
    return message(('map', 'base', number), *LONG, stamp=NOW + number)


@pytest.fixture
def patient_router():
    router = Router(transport=PATIENT)
    yield router
    router.kill()


def test_gap_whose_request_dies_with_the_router_is_filled_when_it_is_back(
        patient_router, tmp_path):
    router = patient_router
    patient = tmp_path / 'patient.json5'
    patient.write_text(json.dumps({'transport': PATIENT}))
    with HeldLink(router.endpoint) as link, session_at(router.endpoint) as near, \
            FarRobot(link.endpoint, patient, 100 * MANY) as robot, \
            RobotPublisher(near, 'robot8') as other, \
            FleetListener(router.endpoint, cache_time=UNLIMITED, quota=WIDE) as listener:
        heard = near.declare_subscriber('robot7/tf', handlers.RingChannel(100))
        send_first(listener, robot, large(0))
        send_first(listener, other, message(('map', 'base', 8), stamp=NOW))
        # The robot hears no request, and what it sends is too much for the link.
        with link.held():
            for number in range(1, MANY):
                robot.send(large(number))
            link.up.set()
            # The end of the gap. What another robot sends after that arrives after it.
            last = message(('map', 'base', MANY), stamp=NOW + MANY)
            until(lambda: robot.send(last) or last in _payloads(heard))
            other.send(message(('map', 'after', 8), stamp=NOW))
            assert x_of(listener.buffer, 'map', 'robot8/after') == 8.0
            router.kill()
            until(lambda: robot_of(listener, 'robot7').lost)
        router.start()
        until(lambda: robot_of(listener, 'robot7').lost == 0)
        until(lambda: set(listener.buffer.stamps_of('robot7/base').tolist()) == set(
            range(NOW, NOW + MANY + 1)))
        assert robot_of(listener, 'robot7').recovered


def _payloads(subscriber):
    return [sample.payload.to_bytes() for sample in iter(subscriber.try_recv, None)]


# --- the parts

def sample(number):
    return SimpleNamespace(source_info=SimpleNamespace(source_sn=number))


def filled(gap, *numbers):
    for number in numbers:
        gap.receive(sample(number))


def test_gap_takes_each_message_once_and_ends_with_one_behind_it():
    found = []
    gap = Gap('robot7', 'robot7/tf', ('1234', 7), range(5, 9), lambda robot, one: found.append(
        one.source_info.source_sn))
    filled(gap, 3, 4, 5, 6)
    assert not gap.ended and gap.selector == 'robot7/tf/@adv/*/1234/7/**?_sn=7..'
    # It is asked again, and its publisher no longer keeps the seventh.
    filled(gap, 5, 6, 8)
    assert found == [5, 6, 8] and gap.ended
    filled(gap, 9, 10)
    gap.receive(SimpleNamespace(source_info=None))
    assert found == [5, 6, 8]


def test_gap_of_which_nothing_is_kept_ends_with_the_first_answer():
    found = []
    gap = Gap('robot7', 'robot7/tf', ('1234', 7), range(5, 9), lambda *one: found.append(one))
    filled(gap, 12)
    assert gap.ended and not found


def test_gap_of_billions_costs_no_more_than_what_is_kept():
    found = []
    roster, sender = Roster(True, RobotQuota()), ('1234', 7)
    roster.admit('robot7')
    roster.number('robot7', sender, 0, True)
    missing = roster.number('robot7', sender, 2**32 - 1, True)
    roster.miss(sender, len(missing))
    gap = Gap('robot7', 'robot7/tf', sender, missing, lambda *one: found.append(one))
    filled(gap, 2**32 - 3, 2**32 - 2, 2**32 - 1)
    assert gap.ended and len(found) == 2
    # The numbers of rmw_zenoh have 64 bits.
    roster.number('robot7', ('rmw', 0), 0, False)
    roster.number('robot7', ('rmw', 0), 2**63 - 1, False)
    assert robot_of(roster, 'robot7').lost == 2**32 - 2 + 2**63 - 2


def test_messages_that_exceed_a_quota_are_not_requested_again():
    roster, sender = Roster(True, RobotQuota(messages_per_s=0.2)), ('1234', 7)
    roster.admit('robot7')
    assert not any(roster.refusal('robot7', 1) for _ in range(2))
    assert list(roster.number('robot7', sender, 3, True)) == []
    assert list(roster.number('robot7', sender, 6, True)) == [4, 5]
    assert roster.refusal('robot7', 1)
    assert list(roster.number('robot7', sender, 9, True)) == []
    assert list(roster.number('robot7', sender, 11, True)) == [10]
    assert robot_of(roster, 'robot7').lost == 0, 'Zenoh reports these'


def test_a_message_that_is_found_is_no_longer_lost():
    roster, sender = Roster(True, RobotQuota()), ('1234', 7)
    roster.admit('robot7')
    roster.number('robot7', sender, 3, True)
    roster.miss(sender, 2)
    for lost in (1, 0, 0):
        roster.find('robot7')
        assert robot_of(roster, 'robot7').lost == lost
    roster.miss(sender, 1)
    assert robot_of(roster, 'robot7').lost == 0, 'it was found before it was reported'
    roster.miss(sender, 1)
    assert robot_of(roster, 'robot7').lost == 1


def test_numbers_start_anywhere_and_only_grow():
    counts = RobotCounts(0, RobotQuota())
    sender = ('1234', 7)
    assert [list(counts.number(sender, number)) for number in (7, 8, 5, 8, 10, 9, 11)] == [
        [], [], [], [], [9], [], []]


# --- the queue

def gap_of(robot, number):
    return Gap(robot, f'{robot}/tf', ('1234', 7), range(number, number + 2), None)


def test_requests_of_a_robot_and_of_all_are_limited(monkeypatch):
    monkeypatch.setattr(requesting, 'MOST_OF_ONE', 10)
    monkeypatch.setattr(requesting, 'MOST_OF_ALL', 100)
    monkeypatch.setattr(requesting, 'MOST_TRIES', 1)
    asked, kept = [], []
    session = SimpleNamespace(get=lambda selector, *_, **__: asked.append(selector) or ())
    requests = Requests(session)
    for robot in range(200):
        for number in range(20):
            requests.add(gap_of(f'robot{robot}', 10 * number))
        # The oldest are dropped.
        most = max(1, min(10, 100 // (robot + 1)))
        kept += [gap_of(f'robot{robot}', 10 * number).selector for number in range(20)[-most:]]
    assert 300 < len(kept) < 600
    thread = threading.Thread(target=requests.work)
    thread.start()
    until(lambda: len(asked) == len(kept))
    requests.close()
    thread.join()
    assert sorted(asked) == sorted(kept)


class Wanted:
    """A request that ends with its answer."""

    def __init__(self, robot, key):
        self.robot, self.selector, self.tries, self.ended = robot, key, 0, False

    def receive(self, sample):
        self.ended = True


@pytest.fixture
def requests(session, monkeypatch):
    """Return the queue, and its thread at work."""
    monkeypatch.setattr(requesting, 'ANSWER_S', 0.05)
    monkeypatch.setattr(requesting, 'PAUSE_S', 0.05)
    requests = Requests(session)
    thread = threading.Thread(target=requests.work)
    thread.start()
    yield requests
    requests.close()
    thread.join()


def test_request_that_is_not_answered_in_time_is_repeated(requests, session, hall):
    key, held = f'{hall}/slow', []

    def answer(query):
        if len(held) < 2:
            held.append(query)  # a stored query keeps the other side waiting
        else:
            query.reply(key, b'')

    queryable = session.declare_queryable(key, answer)
    slow = Wanted('robot7', key)
    requests.add(slow)
    until(lambda: slow.ended)
    queryable.undeclare()


def test_request_that_is_never_answered_is_given_up_until_its_robot_returns(
        requests, session, hall):
    asked = []
    queryable = session.declare_queryable(f'{hall}/never', asked.append)
    never = Wanted('robot7', f'{hall}/never')
    requests.add(never)
    until(lambda: never.tries == requesting.MOST_TRIES)
    assert len(asked) == requesting.MOST_TRIES
    requests.repeat('robot7')
    until(lambda: len(asked) == 2 * requesting.MOST_TRIES == 2 * never.tries)
    queryable.undeclare()
    asked.clear()


def test_request_that_nobody_has_received_yet_is_repeated(requests, session, hall, monkeypatch):
    """A robot's token may arrive before its declarations, without which it gets no request."""
    monkeypatch.setattr(requesting, 'MOST_TRIES', 10**9)
    early = Wanted('robot7', f'{hall}/early')
    requests.add(early)
    until(lambda: early.tries)
    queryable = session.declare_queryable(early.selector, lambda query: query.reply(
        early.selector, b''))
    until(lambda: early.ended)
    queryable.undeclare()


def test_request_to_a_robot_that_is_away_waits_for_its_return(requests, session, hall):
    away = Wanted('robot7', f'{hall}/away')
    requests.add(away)
    until(lambda: away.tries == requesting.MOST_TRIES)
    queryable = session.declare_queryable(away.selector, lambda query: query.reply(
        away.selector, b''))
    requests.repeat('robot8')
    assert not away.ended
    requests.repeat('robot7')
    until(lambda: away.ended)
    queryable.undeclare()
