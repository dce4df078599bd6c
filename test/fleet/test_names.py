# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""No robot can look like another unnoticed, nor use up the names of others."""

import sys
import unicodedata

from conditions import until
from fleet_helpers import message, robot_of, x_of
import pytest
from tf_tree_py.fleet import FleetError, FleetListener, names, RobotPublisher, RobotQuota
from tf_tree_py.fleet.keys import check_prefix, check_robot, check_robots, key_of, token_of, Topic
from tf_tree_py.fleet.names import deception_in, look_of, Names
from tf_tree_py.fleet.roster import Roster
import zenoh

CYRILLIC_O = 'r\u043ebot1'
HIDDEN = {
    'robot1 ': 'white space', ' robot1': 'white space', 'site /robot1': 'white space',
    'robot1\t': 'white space', 'robot1\u3000': 'white space', 'robot\u00a01': 'NO-BREAK SPACE',
    'robot\u200b1': 'ZERO WIDTH SPACE', 'robot1\u200d': 'ZERO WIDTH JOINER',
    'robot1\ufeff': 'ZERO WIDTH NO-BREAK SPACE', 'robot\u00ad1': 'SOFT HYPHEN',
    '\u202erobot1': 'RIGHT-TO-LEFT OVERRIDE', 'robot1\u2069': 'POP DIRECTIONAL ISOLATE',
    'robot1\u200e': 'LEFT-TO-RIGHT MARK', 'robot\n1': 'U\\+000A', 'robot1\x7f': 'U\\+007F',
    'robot1\u2028x': 'LINE SEPARATOR', 'robot1\u3164': 'HANGUL FILLER',
    'robot1\ufe0f': 'VARIATION SELECTOR-16', 'robot\u28001': 'BRAILLE PATTERN BLANK',
    'robot1\ue000': 'U\\+E000'}


# --- what cannot be seen

@pytest.mark.parametrize(('name', 'why'), HIDDEN.items(), ids=ascii)
def test_names_with_what_cannot_be_seen_are_refused_at_once(name, why):
    for check in (check_robot, check_prefix, check_robots):
        with pytest.raises(FleetError, match=why) as raised:
            check(name)
        assert str(raised.value).isprintable()
    with pytest.raises(FleetError, match=why):
        RobotPublisher(None, name)
    with pytest.raises(FleetError, match=why):
        FleetListener('tcp/127.0.0.1:9', name)


def test_no_control_format_or_separator_of_unicode_is_let_in():
    let_in = [char for char in map(chr, range(sys.maxunicode + 1))
              if unicodedata.category(char) in ('Cc', 'Cf', 'Cs', 'Zl', 'Zp', 'Zs')
              and char != ' ' and not deception_in(f'robot{char}1')]
    assert not let_in


@pytest.mark.parametrize('name', [
    'robot7', 'Robot_7-a.b', 'site/robot7', 'robot 7', 'Förderer', 'ロボット7', 'робот', 'ρομπότ',
    'रोबोट', 'روبوت', '로봇7'])
def test_names_in_any_script_are_let_in(name):
    assert not deception_in(name) and check_robot(name) == name


def test_robot_that_hides_in_its_name_is_refused_counted_and_told_once(
        listen, robot, session, hall, caplog, clock):
    listener, good = listen(), robot('robot1')
    good.send(message(('map', 'base', 1)))
    assert x_of(listener.buffer, 'map', 'robot1/base') == 1.0
    hidden = ['robot1 ', 'robot1\u200b', 'robot1\u202e']
    tokens = [session.liveliness().declare_token(token_of(name, hall)) for name in hidden]
    for name in hidden:
        for _ in range(10):
            session.put(key_of(Topic(name, False), hall), message(('map', 'base', 666)),
                        congestion_control=zenoh.CongestionControl.BLOCK)
    until(lambda: listener.ignored == 3 + 30)
    assert [one.name for one in listener.robots()] == ['robot1']
    assert listener.buffer.lookup('map', 'robot1/base').x == 1.0
    lines = [record.getMessage() for record in caplog.records]
    assert sum("'robot1 ' is ignored" in line for line in lines) == 1
    assert sum("'robot1\\u200b' is ignored" in line for line in lines) == 1
    assert sum("'robot1\\u202e' is ignored" in line for line in lines) == 1
    assert len(lines) == 3 and all(line.isascii() for line in lines)
    for token in tokens:
        token.undeclare()


# --- what looks alike

@pytest.mark.parametrize(('one', 'other'), [
    ('robot1', CYRILLIC_O), ('robot1', 'rob\u03bft1'), ('robot1', 'robotl'), ('robot1', 'robotI'),
    ('robot0', 'robotO'), ('robot1', '\uff52obot1'), ('robot1', 'robot\uff11'),
    ('robot1', '\U0001d42bobot1'), ('robot-1', 'robot\u20111'), ('robot-1', 'robot\u22121'),
    ('robot 1', 'robot  1'), ('r\u00f3bot1', 'ro\u0301bot1'), ('site/robot1', 'site\u2215robot1'),
    ('\u0440\u043e\u0431\u043e\u0442', 'po\u0431o\u0442'),
    ('PABXE', '\u0420\u0410\u0412\u0425\u0415')], ids=ascii)
def test_names_that_look_alike_are_served_and_told_once(one, other):
    known = Names(True, 100)
    assert known.admit(one) == (True, None)
    admitted, report = known.admit(other)
    assert admitted and report.text.isascii()
    assert ascii(one) in report.text and ascii(other) in report.text


@pytest.mark.parametrize(('one', 'other'), [
    ('robot1', 'robot2'), ('robot1', 'Robot1'), ('robot1', 'robot11'), ('a/robot1', 'b/robot1'),
    ('robot1', 'robot-1'), ('rn', 'm'), ('vv', 'w'),
    ('\u0440\u043e\u0431\u043e\u0442', '\u0440\u043e\u0431\u043e\u0442\u044b')], ids=ascii)
def test_names_that_do_not_look_alike_are_not_told(one, other):
    assert look_of(one) != look_of(other)


def test_listener_tells_of_a_robot_with_a_letter_of_another_alphabet(listen, robot, caplog):
    listener = listen()
    for number, name in enumerate(('robot1', CYRILLIC_O)):
        one = robot(name)
        for _ in range(3):
            one.send(message(('map', 'base', number)))
        assert x_of(listener.buffer, 'map', f'{name}/base') == number
    assert len(listener.robots()) == 2 and listener.ignored == 0
    (record,) = caplog.records
    assert record.getMessage().startswith("the names of the robots 'robot1' and 'r\\u043ebot1'")


# --- how many

def test_robot_confined_below_its_name_does_not_use_up_the_names_of_others():
    roster = Roster(True, RobotQuota())
    ours = [roster.admit(f'robot7/x{number}')[0] for number in range(10_000)]
    assert ours.count(True) == 100 and roster.ignored == 9_900
    # It may also use longer names, in any order.
    theirs = [roster.admit(f'robot8/{number % 7}/{number}/x')[0] for number in range(10_000)]
    assert theirs.count(True) <= 100
    for number in range(5_000):
        assert roster.admit(f'r{number}') == (True, None)
    assert roster.admit('site/robot1') == (True, None)


def test_robot_of_a_site_leaves_names_to_the_other_robots_of_the_site():
    roster = Roster(True, RobotQuota(names=50))
    assert [roster.admit(f'site/robot7/x{number}')[0] for number in range(50)].count(True) == 5
    assert [roster.admit(f'site/r{number}')[0] for number in range(50)].count(True) == 45


def test_all_robots_together_are_limited(monkeypatch):
    monkeypatch.setattr(names, 'MOST_NAMES', 3)
    known = Names(True, 100)
    assert [known.admit(f'r{number}')[0] for number in range(5)] == [True] * 3 + [False] * 2
    assert known.refused == 2


def test_flood_of_refused_names_does_not_hide_a_name_that_looks_alike(
        listen, robot, session, hall, caplog, clock):
    listener = listen()
    robot('robot1').send(message(('map', 'base', 1)))
    assert x_of(listener.buffer, 'map', 'robot1/base') == 1.0
    tokens = [session.liveliness().declare_token(token_of(f'robot{number} ', hall))
              for number in range(50)]
    until(lambda: listener.ignored == 50)
    robot(CYRILLIC_O).send(message(('map', 'base', 2)))
    assert x_of(listener.buffer, 'map', f'{CYRILLIC_O}/base') == 2.0
    # Its token arrives in another thread of Zenoh, which may write the line after the answer.
    until(lambda: len(caplog.records) >= 12)
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == 12 and "'robot1' and 'r\\u043ebot1' look alike" in lines[-1]
    clock.now += 1.0
    until(lambda: len(caplog.records) == 13)
    counted = caplog.records[-1].getMessage()
    assert counted.startswith('39 more like this') and "such as 'robot" in ascii(counted)
    for token in tokens:
        token.undeclare()


def test_invented_robots_are_told_once_and_harm_no_others(
        listen, robot, session, hall, caplog, clock):
    listener = listen('**', quota=RobotQuota(names=5))
    tokens = [session.liveliness().declare_token(token_of(f'robot7/x{number}', hall))
              for number in range(50)]
    until(lambda: listener.ignored == 45)
    robot('robot8').send(message(('map', 'base', 8)))
    assert x_of(listener.buffer, 'map', 'robot8/base') == 8.0
    assert robot_of(listener, 'robot8').here and len(listener.robots()) == 6
    (record,) = caplog.records
    assert "robots below 'robot7' are ignored beyond the first 5" in record.getMessage()
    for token in tokens:
        token.undeclare()
