# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a doctor keeps of messages and incidents, its limits, and the order of its findings."""

import math

from clock_scenes import BEGIN, message, MS, SECOND, stream
import pytest
from tf_tree_py.core.edges.packed import pack_pose
from tf_tree_py.core.messages.incidents import Incident, Kind
from tf_tree_py.core.messages.observers import Endpoint
from tf_tree_py.core.text import shorten
from tf_tree_py.health.checks.catalogue import CODES
from tf_tree_py.health.checks.finding import Remark, Severity
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds
from tf_tree_py.health.ros_graph import NO_GRAPH, RosGraph


def doctor_of(*messages, **how):
    doctor = Doctor(**how)
    for each in messages:
        doctor.received(each)
    return doctor


def case_of(doctor, *now):
    """Return what the checks of a doctor examine."""
    seen = []
    look = CODES['gap']._replace(look=lambda case: seen.append(case) or ())
    doctor.findings(*now, checks=[look])
    return seen[0]


# --- messages

def test_new_doctor_has_seen_nothing():
    doctor = Doctor()
    assert (doctor.transforms, doctor.watched, doctor.recorded) == (0, 0, False)
    assert (doctor.endpoints, doctor.graph, doctor.limits) == ((), NO_GRAPH, Thresholds())
    assert (doctor.pop_recent(), doctor.signs(), doctor.left_behind()) == ({}, [], set())
    assert (case_of(doctor).now, case_of(doctor, 5).now) == (0, 5)


def test_time_is_that_from_the_first_arrival_to_the_last():
    doctor = doctor_of(message('a>b', received=0), message('a>b', 'b>c', at=2.0),
                       message('a>b', at=5.0), message('a>b', received=0))
    assert (doctor.transforms, doctor.watched) == (5, 3 * SECOND)
    assert case_of(doctor).now == BEGIN + 5 * SECOND
    assert case_of(doctor, BEGIN).now == BEGIN + 5 * SECOND
    assert case_of(doctor, BEGIN + 6 * SECOND).now == BEGIN + 6 * SECOND


def test_case_has_all_that_the_doctor_knows():
    doctor = doctor_of(message('a>b', slashed=['/a']), message('c>b', at=1.0),
                       limits=Thresholds(max_speed=3.0), recorded=True)
    doctor.endpoints = [Endpoint('/tf', False, '/n', True, True, False)]
    doctor.graph = RosGraph(simulated=True)
    case = case_of(doctor)
    assert [edge.frames for edge in case.edges] == [('a', 'b'), ('c', 'b')]
    assert (case.limits, case.recorded, case.slashed) == (Thresholds(max_speed=3.0), True, {'/a'})
    assert (case.endpoints, case.graph) == (doctor.endpoints, doctor.graph)
    assert (case.parents['b'].switches, case.troubles) == (1, {})


def test_names_with_a_slash_are_kept_up_to_a_limit():
    names = [f'/n{number}' for number in range(1001)]
    doctor = doctor_of(*(message('a>b', slashed=[name]) for name in names[:999]))
    doctor.received(message('a>b', slashed=names[999:]))
    assert len(case_of(doctor).slashed) == 1001
    doctor.received(message('a>b', slashed=['/more']))
    assert '/more' not in case_of(doctor).slashed


@pytest.mark.parametrize(('length', 'expected'), [(1000, True), (1001, False)])
def test_edges_with_long_names_are_left_out(length, expected):
    long = 'n' * length
    doctor = doctor_of(message(f'a>{long}'), message('a>b'), message(f'{long}>b'))
    assert [edge.frames for edge in case_of(doctor).edges] == (
        [('a', long), ('a', 'b'), (long, 'b')] if expected else [('a', 'b')])
    assert doctor.transforms == 3


def test_edges_are_kept_up_to_a_limit_and_then_still_measured():
    names = [f'r>{number}' for number in range(10_001)]
    nothing = [pack_pose(*[math.nan] * 7)] * len(names)  # measured faster than poses
    many, two = message(*names, static=True), message(*names[9_999:], static=True, at=1.0)
    doctor = doctor_of(many._replace(batch=many.batch._replace(poses=nothing)), two)
    assert [(sign.child, sign.count) for sign in doctor.signs()] == [
        *((str(number), 1) for number in range(9_999)), ('9999', 2)]


# --- incidents

def incident(kind=Kind.LOOP, parent='a', child='b', authority='/n', detail='first'):
    return Incident(kind, parent, child, 0, authority, detail)


def test_incidents_are_counted_by_kind_and_edge():
    doctor = doctor_of(message('a>b'), message('b>c'))
    doctor.saw_incidents([incident(), incident(authority='/m', detail='second')])
    doctor.saw_incidents([incident(), incident(Kind.OLD_DATA), incident(Kind.JUMP_BACK),
                          incident(child='c')])
    troubles = {key: (trouble.count, [*trouble.authorities], trouble.detail)
                for key, trouble in case_of(doctor).troubles.items()}
    assert troubles == {
        (Kind.LOOP, 'a', 'b'): (3, ['/n', '/m'], 'first'),
        (Kind.OLD_DATA, 'a', 'b'): (1, ['/n'], 'first'),
        (Kind.JUMP_BACK, 'a', 'b'): (1, ['/n'], 'first'),
        (Kind.LOOP, 'a', 'c'): (1, ['/n'], 'first')}
    assert [(sign.child, sign.refused) for sign in doctor.signs()] == [('b', 4), ('c', 0)]
    recent = doctor.pop_recent()
    assert {edge: (one.count, dict(one.incidents)) for edge, one in recent.items()} == {
        ('a', 'b'): (1, {Kind.LOOP: 3, Kind.OLD_DATA: 1, Kind.JUMP_BACK: 1}),
        ('a', 'c'): (0, {Kind.LOOP: 1}), ('b', 'c'): (1, {})}
    assert doctor.pop_recent() == {}


def test_static_samples_are_not_recent():
    doctor = doctor_of(message('a>b', static=True), message('b>c'), message('b>c', at=0.1))
    assert {edge: one.count for edge, one in doctor.pop_recent().items()} == {('b', 'c'): 2}
    doctor.received(message('b>c', at=0.2))
    assert {edge: one.count for edge, one in doctor.pop_recent().items()} == {('b', 'c'): 1}


def test_incidents_of_long_names_are_shortened():
    doctor = Doctor()
    long, fits = 'n' * 1001, 'm' * 1000
    doctor.saw_incidents([incident(parent=long, child=fits), incident(parent=fits, child=long)])
    short = shorten(long, 1000)
    assert short != long
    assert [*case_of(doctor).troubles] == [(Kind.LOOP, short, fits), (Kind.LOOP, fits, short)]
    assert [*doctor.pop_recent()] == [(short, fits), (fits, short)]


def test_incidents_are_kept_up_to_a_limit_and_then_still_counted():
    doctor = Doctor()
    doctor.saw_incidents([incident(child=f'c{number}') for number in range(1002)])
    doctor.saw_incidents([incident(child='c1001'), incident(child='c999')])
    troubles = case_of(doctor).troubles
    assert [child for _, _, child in troubles] == [f'c{number}' for number in range(1000)]
    assert troubles[Kind.LOOP, 'a', 'c999'].count == 2


def test_as_many_publishers_of_incidents_are_kept_as_there_are_kinds():
    doctor = Doctor()
    doctor.saw_incidents([incident(authority=f'/n{number}') for number in range(30)])
    trouble, = case_of(doctor).troubles.values()
    assert trouble.count == 30
    assert [*trouble.authorities] == [f'/n{number}' for number in range(len(Kind))]


# --- what is left behind

def test_edges_that_cannot_answer_for_the_present_are_left_behind():
    doctor = doctor_of(*sorted(
        [*stream('a>b', 'b>c'), *stream('b>gone', end=8.9), *stream('b>here', end=9.0),
         *stream('b>other', lead=-100.0), *stream('b>fixed', end=2.0, static=True)],
        key=lambda each: each.received))
    assert doctor.left_behind() == {('b', 'other'), ('b', 'gone')}
    later = BEGIN + round(9.9 * SECOND) + SECOND
    assert doctor.left_behind(later) == {('b', 'other'), ('b', 'gone'), ('b', 'here')}
    assert doctor.left_behind(later + MS) == {
        ('a', 'b'), ('b', 'c'), ('b', 'other'), ('b', 'gone'), ('b', 'here')}
    assert doctor.left_behind(BEGIN) == {('b', 'other'), ('b', 'gone')}


def test_silence_is_measured_up_to_now_or_the_last_arrival():
    doctor = doctor_of(*stream('a>b', end=5.0), *stream('b>c', begin=5.0))
    end = BEGIN + round(9.9 * SECOND)
    for now in (0, BEGIN, end):
        assert [sign.silence for sign in doctor.signs(now)] == [5 * SECOND, 0]
    assert [sign.silence for sign in doctor.signs(end + SECOND)] == [6 * SECOND, SECOND]


@pytest.mark.parametrize(('later', 'expected'), [
    (-1, True), (0, False), (1, False), (100 * MS - 1, False), (100 * MS, True)])
def test_comparison_of_the_clocks_is_reused_for_a_moment(later, expected):
    """An edge of another clock appears after it."""
    doctor = doctor_of(*stream('a>b', 'b>c'))
    now = BEGIN + 10 * SECOND
    doctor.findings(now)
    for each in stream('b>other', lead=-100.0):
        doctor.received(each)
    assert (('b', 'other') in doctor.left_behind(now + later)) is expected
    doctor.findings(now + later)
    assert ('b', 'other') in doctor.left_behind(now + later)


# --- findings

def check_of(code, *remarks):
    return CODES[code]._replace(look=lambda case: remarks)


def remark(name='a>b', severity=None, **evidence):
    edge = tuple(name.split('>'))
    return Remark('text', edge, (), evidence, severity, edges=(edge,))


def codes(*checks, doctor=None):
    return [(one.code, one.frames[1], one.severity.value)
            for one in (doctor or Doctor()).findings(checks=checks)]


def test_findings_are_sorted_by_severity_catalogue_and_count():
    found = codes(
        check_of('post_dated', remark('a>note')),
        check_of('gap', remark('a>none'), remark('a>zero', count=0), remark('a>one', count=1),
                 remark('a>few', count=3), remark('a>error', Severity.ERROR)),
        check_of('loop', remark('a>last', count=1), remark('a>first', count=5),
                 remark('a>warn', Severity.WARNING)))
    places = [*CODES]
    assert places.index('loop') < places.index('gap')
    assert found == [
        ('loop', 'first', 'error'), ('loop', 'last', 'error'), ('gap', 'error', 'error'),
        ('loop', 'warn', 'warning'), ('gap', 'few', 'warning'), ('gap', 'one', 'warning'),
        ('gap', 'none', 'warning'), ('gap', 'zero', 'warning'), ('post_dated', 'note', 'note')]


def test_symptoms_are_left_out():
    assert 'gap' in CODES['clock_step'].explains
    assert codes(check_of('gap', remark('a>b'), remark('a>c')),
                 check_of('clock_step', remark('a>b'))) == [
        ('clock_step', 'b', 'warning'), ('gap', 'c', 'warning')]


def test_hundred_findings_of_a_code_are_enough():
    found = codes(check_of('gap', *(remark(f'a>{number}') for number in range(102))),
                  check_of('loop', remark()))
    assert found[1:] == [('gap', str(number), 'warning') for number in range(100)]


def test_all_checks_are_applied_by_default():
    doctor = Doctor()
    doctor.saw_incidents([incident(Kind.SELF_EDGE, child='a')])
    assert [one.code for one in doctor.findings()] == ['self_edge']
    assert doctor.findings(checks=()) == []
