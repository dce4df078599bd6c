# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Findings as data, which of them are symptoms, and how a check makes them."""

import math

from clock_scenes import case_of, edge_of, regular
import pytest
from tf_tree_py.health.checks.case import Trouble
from tf_tree_py.health.checks.catalogue import CHECKS, CODES
from tf_tree_py.health.checks.finding import (
    authorities_of,
    check,
    Finding,
    names_of,
    of_edge,
    of_edges,
    of_trouble,
    Remark,
    Severity,
    times,
)

AB, BC = ('a', 'b'), ('b', 'c')


def test_errors_rank_before_warnings_and_notes():
    assert [one.rank for one in (Severity.ERROR, Severity.WARNING, Severity.NOTE)] == [0, 1, 2]


@pytest.mark.parametrize(('publishers', 'one_of', 'expected'), [
    ((), True, ''), (('/a',), True, '/a'), (('/a', '/b'), True, 'one of /a, /b'),
    (('/a', '/b'), False, '/a, /b')])
def test_senders_in_words(publishers, one_of, expected):
    assert Finding('x', Severity.NOTE, (), publishers, '', one_of=one_of).senders == expected


def finding(code='gap', severity=Severity.WARNING, edges=(AB,)):
    return Finding(code, severity, (), (), '', edges=edges)


@pytest.mark.parametrize(('severity', 'other', 'expected'), [
    (Severity.WARNING, finding(), True),
    (Severity.ERROR, finding(), True),
    (Severity.NOTE, finding(), False),
    (Severity.WARNING, finding('stale'), False),
    (Severity.WARNING, finding(edges=()), False),
    (Severity.WARNING, finding(edges=(BC, AB)), True),
    (Severity.WARNING, finding(edges=(('b', 'a'),)), False),
    (Severity.WARNING, finding(edges=(AB, ('c', 'd'))), False)])
def test_symptom_is_no_worse_and_only_of_the_same_edges(severity, other, expected):
    cause = finding('clock_step', severity, (AB, BC))
    assert cause.causes(other, {'gap'}) is expected


def test_finding_without_details_is_plain_data():
    assert Finding('gap', Severity.NOTE, AB, ('/n',), 'text').as_dict() == {
        'code': 'gap', 'severity': 'note', 'frames': ['a', 'b'], 'publishers': ['/n'],
        'summary': 'text', 'evidence': {}, 'cause': '', 'fix': '', 'edges': [], 'one_of': False}
    data = Finding('gap', Severity.ERROR, (), (), '', {'count': 1, 'far_m': math.inf,
                                                       'x': math.nan}, edges=(AB,)).as_dict()
    assert (data['evidence'], data['edges']) == ({'count': 1, 'far_m': None, 'x': None},
                                                 [['a', 'b']])


# --- checks

@check(Severity.WARNING, catches='this', cause='usual', fix='mend', recorded_fix='record again',
       explains=('gap',), textbook=True)
def broken(case):
    yield Remark('one', AB, ('one of /m, /n', '/n'), {'count': 2}, edges=(AB,))
    yield Remark('two', (), (), {}, Severity.ERROR, 'own cause', 'own fix')


@check(Severity.NOTE, catches='that', cause='any', fix='none')
def plain(case):
    yield Remark('text', ('a',), ('/n',), {})


def test_check_completes_a_remark():
    one = Finding('broken', Severity.WARNING, AB, ('/m', '/n'), 'one', {'count': 2}, 'usual',
                  'mend', (AB,), True)
    two = Finding('broken', Severity.ERROR, (), (), 'two', {}, 'own cause', 'own fix', (), False)
    assert list(broken.findings(case_of())) == [one, two]
    recorded, other = broken.findings(case_of(recorded=True))
    assert (recorded.fix, other.fix) == ('record again', 'own fix')
    expected = Finding('plain', Severity.NOTE, ('a',), ('/n',), 'text', {}, 'any', 'none')
    assert list(plain.findings(case_of())) == list(plain.findings(case_of(recorded=True))) == [
        expected]


def test_check_has_the_name_of_its_function():
    assert broken._replace(look=None) == (
        'broken', Severity.WARNING, 'this', 'usual', 'mend', 'record again', {'gap'}, True, None)
    assert plain._replace(look=None) == (
        'plain', Severity.NOTE, 'that', 'any', 'none', '', frozenset(), False, None)


def test_codes_of_the_textbook_come_first_and_all_are_checked():
    textbook = [one.textbook for one in CHECKS]
    assert textbook == sorted(textbook, reverse=True) and True in textbook and False in textbook
    assert list(CODES) == [one.name for one in CHECKS]
    assert {'loop', 'clock_step', 'no_clock', 'gap'} < {*CODES}


# --- remarks

A, B = (edge_of(name, regular(2), senders=senders) for name, senders in (
    ('a>b', ['/n', '/m']), ('b>c', ['/n', '/o'])))


def test_remarks_on_edges():
    assert of_edge(A, 'is bad', {'x': 1}, fix='mend') == Remark(
        'a -> b is bad', AB, ('/m', '/n'), {'x': 1}, fix='mend', edges=(AB,))
    assert of_edges([A, B], 'are bad', {'x': 1}, cause='c') == Remark(
        'are bad', ('a', 'b', 'c'), ('/m', '/n', '/o'), {'x': 1}, cause='c', edges=(AB, BC))
    assert authorities_of() == ()


@pytest.mark.parametrize(('frames', 'edges'), [(AB, (AB,)), (('a',), ()), ((), ()),
                                               (('a', 'b', 'c'), ())])
def test_remarks_on_incidents(frames, edges):
    trouble = Trouble(3, {'/n': None}, 'detail')
    assert of_trouble(frames, 'text', trouble) == Remark(
        'text', frames, trouble.authorities, {'count': 3}, edges=edges)
    assert of_trouble(frames, 'text', trouble, evidence={'x': 1}, cause='c') == Remark(
        'text', frames, trouble.authorities, {'count': 3, 'x': 1}, cause='c', edges=edges)


def test_names_and_numbers_in_words():
    assert names_of(['one of /b, /a', '/c', '', '/a']) == ('/b', '/a', '/c')
    assert [times(count) for count in (0, 1, 2, 3)] == ['0 times', 'once', 'twice', '3 times']
