# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The rows of the monitor: their order, their findings, and the rates over the last seconds."""

from clock_scenes import BEGIN, message, SECOND, stream
import pytest
from tf_tree_py.health.checks.finding import Finding, Severity
from tf_tree_py.health.doctor import Doctor, Monitor, Watched


def finding(severity, *frames):
    return Finding('gap', severity, frames, (), '')


class Watch:
    """A monitor, and the messages that its doctor receives between two looks."""

    def __init__(self):
        self.doctor = Doctor()
        self.monitor = Monitor(self.doctor)

    def receive(self, *messages):
        for each in messages:
            self.doctor.received(each)

    def rows(self, now=0.0, findings=(), clock=0):
        return self.monitor.look(now, findings, clock)

    def rates(self, now, clock=0):
        return {row.signs.child: row.rate_hz for row in self.rows(now, clock=clock)}


def test_worst_edges_come_first_and_then_those_that_move():
    watch = Watch()
    watch.receive(message('r>static', 'r>pinned', static=True),
                  message('r>calm', 'r>late', 'r>wrong', 'r>odd'))
    error, warning, note = (finding(severity, 'r', child) for severity, child in (
        (Severity.ERROR, 'wrong'), (Severity.WARNING, 'late'), (Severity.NOTE, 'odd')))
    other = finding(Severity.NOTE, 'r', 'late')
    pinned = finding(Severity.WARNING, 'r', 'pinned')
    rows = watch.rows(findings=[error, pinned, warning, note, other])
    assert [(row.signs.child, row.severity, row.findings) for row in rows] == [
        ('wrong', Severity.ERROR, (error,)), ('late', Severity.WARNING, (warning, other)),
        ('pinned', Severity.WARNING, (pinned,)), ('odd', Severity.NOTE, (note,)),
        ('calm', None, ()), ('static', None, ())]


@pytest.mark.parametrize(('frames', 'expected'), [
    (('a', 'c'), {'a>c'}), (('a', 'b', 'c'), {'a>c', 'b>c'}), (('c',), set()), ((), set()),
    (('c', 'a'), set())])
def test_finding_concerns_the_edges_to_its_last_frame(frames, expected):
    watch = Watch()
    watch.receive(message('a>c', 'b>c', 'a>b'))
    rows = watch.rows(findings=[finding(Severity.ERROR, *frames)])
    assert {f'{row.signs.parent}>{row.signs.child}' for row in rows if row.findings} == expected


def test_row_is_plain_data():
    watch = Watch()
    watch.receive(*stream('a>b'))
    found = (finding(Severity.WARNING, 'a', 'b'), finding(Severity.NOTE, 'a', 'b'))
    row, = watch.rows(findings=found)
    assert row.as_dict() == {**row.signs.as_dict(), 'rate_hz': row.rate_hz,
                             'severity': 'warning', 'codes': ['gap', 'gap']}
    calm = Watched(row.signs, 2.0, ()).as_dict()
    assert (calm['severity'], calm['codes'], calm['rate_hz']) == (None, [], 2.0)


def test_rates_are_those_since_the_look_five_seconds_ago():
    watch = Watch()
    watch.receive(*stream('a>b', end=2.0))
    assert watch.rates(100.0) == {'b': pytest.approx(10.0)}
    rates = []
    for now, count in ((102.0, 4), (104.0, 10), (106.9, 12), (107.0, 2), (112.0, 6), (112.0, 0)):
        begin = watch.doctor.transforms / 10
        watch.receive(*stream('a>b', begin=begin, end=begin + count / 10))
        rates.append(watch.rates(now)['b'])
    assert rates == pytest.approx([
        4 / 2.0,  # since 100
        14 / 4.0,
        26 / 6.9,  # 106.9 is less than 5 s after 102
        24 / 5.0,  # since 102
        6 / 5.0,  # since 107
        6 / 5.0])


def test_rate_of_few_samples_is_the_overall_one_unless_the_edge_is_silent():
    watch = Watch()
    watch.receive(message('r>static', static=True), message('r>once'),
                  *stream('r>a', 'r>b', end=3.0))
    watch.rates(0.0)
    watch.receive(message('r>a', at=3.0), message('r>new', at=3.1), message('r>new', at=3.2),
                  message('r>new', at=3.3))
    overall = pytest.approx(10.0)
    assert watch.rates(4.0) == {
        'static': 0.0, 'once': 0.0, 'a': overall, 'b': overall, 'new': overall}
    # The stamps go on by the clock of the arrivals alone.
    assert watch.rates(5.0, BEGIN + 10 * SECOND) == {
        'static': 0.0, 'once': 0.0, 'a': 0.0, 'b': 0.0, 'new': 0.0}


def test_two_samples_are_a_rate_unless_no_time_has_passed():
    watch = Watch()
    watch.receive(*stream('a>b', end=3.0))
    watch.rates(7.0)
    watch.receive(*stream('a>b', begin=3.0, end=3.2))
    assert watch.rates(7.0) == {'b': pytest.approx(10.0)}
    assert watch.rates(9.0) == {'b': pytest.approx(1.0)}
    assert watch.rates(8.0) == {'b': pytest.approx(2.0)}
