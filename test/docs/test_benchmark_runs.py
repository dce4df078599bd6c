# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A run of the benchmark that was interrupted continues, if nothing else has changed."""

import json

from benchmark import __main__ as program, machine, report
from benchmark.rows import OURS, Row, TF2_ROS
import pytest


def row(group):
    """Return a row with a ratio and a target."""
    made = Row(group, 'a lookup', 'us', {OURS: [1.0, 2.0], TF2_ROS: [4.0, 5.0]})
    made.compare(OURS, TF2_ROS, 0.2)
    made.judge(OURS, None)
    return made


@pytest.fixture
def groups(monkeypatch):
    """Measure three quick groups, of which 'tree' fails; return the names of those begun."""
    measured = []

    def group(name):
        def measure(contestants, effort):
            measured.append(name)
            if name == 'tree':
                raise RuntimeError(name)
            return [row(name)]
        return measure

    monkeypatch.setattr(program, 'GROUPS', {name: group(name) for name in (
        'depth', 'tree', 'many')})
    return measured


def test_a_row_is_read_as_it_was_written(tmp_path):
    rows, described = [row('depth'), row('many')], machine.describe(quick=True)
    report.write(tmp_path, rows, described, {'Rust': 'not installed'})
    assert report.read(tmp_path) == (rows, described, {'Rust': 'not installed'})


@pytest.mark.parametrize('how', [['--resume'], []])
def test_only_a_resumed_run_keeps_what_was_measured(groups, tmp_path, monkeypatch, how):
    run = ['--quick', '--out', str(tmp_path)]
    with pytest.raises(RuntimeError, match='tree'):
        program.main(run)
    begun = json.loads((tmp_path / 'results.json').read_text())
    begun['machine']['date'] = '2001-02-03T04:05:06+00:00'
    begun['absent']['a turtle'] = 'too slow'
    (tmp_path / 'results.json').write_text(json.dumps(begun))
    assert groups == ['depth', 'tree'] and [each['group'] for each in begun['rows']] == ['depth']

    whole = {name: lambda *_, name=name: groups.append(name) or [row(name)]
             for name in program.GROUPS}
    monkeypatch.setattr(program, 'GROUPS', whole)
    del groups[:]
    program.main([*run, *how])
    results = json.loads((tmp_path / 'results.json').read_text())
    assert groups == (['tree', 'many'] if how else ['depth', 'tree', 'many'])
    assert [each['group'] for each in results['rows']] == ['depth', 'tree', 'many']
    assert (results['machine']['date'] == begun['machine']['date']) == bool(how)
    assert ('a turtle' in results['absent']) == bool(how)


def test_a_run_that_has_measured_nothing_hides_the_one_before(groups, tmp_path, monkeypatch):
    run = ['--quick', '--out', str(tmp_path)]
    with pytest.raises(RuntimeError, match='tree'):
        program.main(run)
    monkeypatch.setattr(program, 'GROUPS', {'tree': program.GROUPS['tree']})
    with pytest.raises(RuntimeError, match='tree'):
        program.main(run)
    assert report.read(tmp_path)[0] == []


def test_a_run_is_not_continued_after_a_change(groups, tmp_path, monkeypatch):
    with pytest.raises(SystemExit, match='there is no run to continue: .*results.json'):
        program.main(['--resume', '--out', str(tmp_path)])
    with pytest.raises(RuntimeError, match='tree'):
        program.main(['--quick', '--out', str(tmp_path)])
    with monkeypatch.context() as other, pytest.raises(
            SystemExit, match='cannot be continued, because compiled changed: begin'):
        other.setattr(machine, 'COMPILED', not machine.COMPILED)
        program.main(['--quick', '--resume', '--out', str(tmp_path)])
    with pytest.raises(SystemExit, match='cannot be continued, because quick changed: begin'):
        program.main(['--resume', '--out', str(tmp_path)])
    results = json.loads((tmp_path / 'results.json').read_text())
    results['machine'] |= {'cpu': 'another', 'code': '00000000'}
    (tmp_path / 'results.json').write_text(json.dumps(results))
    with pytest.raises(SystemExit, match='because code, cpu changed'):
        program.main(['--quick', '--resume', '--out', str(tmp_path)])
    assert groups == ['depth', 'tree']
