# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``scripts/mutate`` puts faults into a copy of the code, and reports those that no test finds."""

import os
import re
import subprocess
import sys

from conditions import until
from mutate import equivalents
from mutations import mutants_of
from programs import completed, Program
import pytest
from small_project import small_project

NEEDS_MONITORING = pytest.mark.skipif(sys.version_info < (3, 12), reason='no sys.monitoring')

# --- the faults


def after(line, before='', indent=''):
    """Return what the faults of a line make of it, in a file that begins with other lines."""
    source = f'{before}{indent}{line}\n'.encode()
    compile(source, 'source', 'exec')
    mutants = mutants_of(source)
    for mutant in mutants:
        compile(mutant.apply(source), 'mutant', 'exec')
        assert mutant.texts(source)[0] == line
        assert mutant.apply(source).startswith(before.encode())
    return [mutant.texts(source)[1] for mutant in mutants]


@pytest.mark.parametrize(('line', 'mutated'), [
    ('a = b < c', ['a = b <= c', 'a = b >= c']),
    ('a = b is None', ['a = b is not None']),
    ('a = b not in c', ['a = b in c']),
    ("a = 'µ' == (b) != c", ["a = 'µ' != (b) != c", "a = 'µ' == (b) == c"]),
    ('a = b and f(c)', ['a = f(c)', 'a = not b and f(c)', 'a = b', 'a = b or f(c)',
                        'a = b and not f(c)']),
    ('a = not (b + c)', ['a = (b + c)', 'a = not (b - c)']),
    ('a = -b // c', ['a = b // c', 'a = -b * c']),
    ('a = b @ c', ['a = c @ b']),
    ('a = 7', ['a = 6', 'a = 8']),
    ('a = 0.5, True, None', ['a = 1.0, True, None', 'a = 0.5, False, None',
                             'a = 0.5, True, 1']),
    ('a = min(b, c)', ['a = max(b, c)']),
    ('a = np.minimum(b, c)', ['a = np.maximum(b, c)']),
    ('a = f(b, c)', ['a = f(c, b)']),
    ('a = b if c else d', ['a = b if not c else d']),
    ('a = [b for b in c if b]', ['a = [b for b in c if not b]']),
    ('a += b', ['a -= b', 'pass']),
    ('a.b = c', ['pass']),
    ('a[b] = c', ['pass']),
    ('a.clear()', ['pass']),
    ('del a[b]', ['pass']),
    ("raise ValueError(f'{a + 1}', 2)", ['pass'])])
def test_line_has_these_faults(line, mutated):
    assert sorted(after(line)) == sorted(mutated)


@pytest.mark.parametrize(('line', 'mutated'), [
    ('return', ['pass']), ('return a', ['return None']), ('return None', ['return 1']),
    ("return f'{a + 1}'", []), ('continue', ['pass'])])
def test_line_of_a_function_has_these_faults(line, mutated):
    assert after(line, 'def f(a):\n  for b in a:\n', '    ') == mutated


@pytest.mark.parametrize('text', [
    '"""A docstring of 2 words."""', "a: 'int | None'", "__slots__ = ('a', 'b')",
    'if TYPE_CHECKING:\n    a = 1', 'assert a > 1', '@a(1)\ndef f(b: 3) -> 4: ...',
    "_log.warning('a', 1)", 'self._logger.error(1)', 'warnings.warn(a, stacklevel=2)',
    "a = 'b' + c", "a = f'{1 + 1}'", "T = TypeVar('T', bound=1)", 'Both = int | str'])
def test_text_and_types_are_left_alone(text):
    assert mutants_of(f'{text}\n'.encode()) == []


def test_fault_names_its_function_and_the_lines_of_its_statement():
    source = b'class A:\n  def f(self):\n    if (a and\n        b):\n      c()\n'
    assert [(each.place, each.line, each.lines) for each in mutants_of(source)] == [
        ('A.f', 3, range(3, 5))] * 4 + [('A.f', 4, range(3, 5))] + [('A.f', 5, range(5, 6))]


# --- the verdicts, of mutate.py with run_lines.py

GAUGE = """
def volume(litres, more=None):
    litres.sort()
    if more:
        litres = litres + more
    return litres


def drain(litres):
    while litres:
        litres.pop()


def beep(tones):
    tones.append('beep')
    tones.reverse()
    return tones
"""
TESTS = {
    'test_gauge': """
        from pathlib import Path
        import os, subprocess, sys
        from tf_tree_py.core.gauge import drain, volume

        def test_volume_is_sorted():
            assert volume([2, 1]) == [1, 2]

        def test_drain_empties():
            file = Path(os.environ['PID'])
            file.write_text(str(os.getpid()))
            drain([1, 2])

        def test_beep_in_another_process():
            program = 'from tf_tree_py.core.gauge import beep; assert beep([]) == ["beep"]'
            assert subprocess.run([sys.executable, '-c', program]).returncode == 0
        """,
    'test_broken': """
        from tf_tree_py.core.gauge import volume

        def test_broken():
            assert volume([1]) == []
        """,
}
EQUIVALENT = """
# A comment.
tf_tree_py/core/gauge.py beep
  before: tones.reverse()
  after: pass
  why: there is only one
"""


@pytest.fixture
def project(tmp_path):
    """Return a project with one file of code, and its tests."""
    folder = tmp_path / 'project'
    folder.mkdir()
    small_project(folder)
    package = folder / 'tf_tree_py'
    (package / 'core').mkdir(parents=True)
    (folder / 'test' / 'core').mkdir()
    for path in (package, package / 'core'):
        (path / '__init__.py').touch()
    (package / 'core' / 'gauge.py').write_text(GAUGE)
    for name, text in TESTS.items():
        (folder / 'test' / 'core' / f'{name}.py').write_text(
            '\n'.join(line.removeprefix(' ' * 8) for line in text.splitlines()))
    (folder / 'test' / 'equivalent_mutants.txt').write_text(EQUIVALENT)
    (folder / '.gitignore').write_text('/.workspace/\n__pycache__\n')
    mutate = folder / 'test' / 'mutate.py'
    limits = '_TIMES, _SPARE_S = 3.0, 10.0'
    assert limits in mutate.read_text()
    mutate.write_text(mutate.read_text().replace(limits, '_TIMES, _SPARE_S = 2.0, 2.0'))
    git(folder, 'init', '--quiet')
    git(folder, 'add', '.')
    git(folder, '-c', 'user.name=a', '-c', 'user.email=a', 'commit', '--quiet', '-m', 'a')
    (tmp_path / 'tmp').mkdir()
    return folder


def git(folder, *arguments):
    return subprocess.run(['git', *arguments], cwd=folder, check=True, capture_output=True,
                          text=True).stdout


def environment(project):
    return {**os.environ, 'TMPDIR': str(project.parent / 'tmp'), 'PYTHONDONTWRITEBYTECODE': '1',
            'PID': str(project.parent / 'pid'), 'TF_TREE_PY_WORKSPACE': ''}


def mutate(project, *arguments):
    """Run the tool there; return its status, and its output."""
    done = completed(sys.executable, project / 'test' / 'mutate.py', *arguments, cwd=project,
                     env=environment(project))
    return done.returncode, done.stdout, done.stderr


def assert_nothing_is_left(project):
    assert git(project, 'status', '--porcelain') == ''
    assert not list((project.parent / 'tmp').glob('mutants-*'))


@NEEDS_MONITORING
def test_faults_are_caught_or_hang_or_survive_or_are_listed(project):
    status, output, errors = mutate(
        project, *(f'tf_tree_py/core/gauge.py:{line}' for line in (3, 5, 10, 11, 15, 16)))
    assert status == 1
    verdicts = [re.sub(r'\d+ s$', 'SECONDS s', line.partition(':')[2].rpartition(' (')[0])
                for line in output.splitlines() if line.startswith('tf_tree_py/')]
    by = 'caught by test/core/test_gauge.py::test'
    assert verdicts == [
        f'3  litres.sort()  ->  pass  {by}_volume_is_sorted',
        '5  litres = litres + more  ->  litres = litres - more  survived, no test runs this line',
        '10  while litres:  ->  while not litres:  survived',
        '11  litres.pop()  ->  pass  timeout after SECONDS s',
        f"15  tones.append('beep')  ->  pass  {by}_beep_in_another_process",
        '16  tones.reverse()  ->  pass  equivalent, there is only one']
    assert [line.split() for line in output.splitlines() if line.startswith(('room', 'core'))] == [
        ['room', 'caught', 'timeout', 'equivalent', 'survived'], ['core', '2', '1', '1', '2']]
    assert '\n-    while litres:\n+    while not litres:\n' in output
    assert output.count('\n+++') == 2
    assert 'test_broken.py fails without a fault, and is left out' in errors
    assert_nothing_is_left(project)


def test_each_listed_equivalent_is_a_fault_of_the_code():
    assert equivalents()


def test_list_prints_faults_in_an_order_that_the_seed_draws(project):
    everything = mutate(project, '--list')[1].splitlines()
    first, again, second = (mutate(project, '--list', '--count', '4', '--seed', seed)[1]
                            for seed in '112')
    assert first == again != second
    assert len(first.splitlines()) == 4 and {*first.splitlines()} < {*everything}
    assert mutate(project, '--list', 'tf_tree_py/core/gauge.py:3')[1] == (
        'tf_tree_py/core/gauge.py:3  litres.sort()  ->  pass\n')
    status, _, error = mutate(project, '--list', 'test')
    assert status == 1 and error.startswith('test is no file or folder below ')


@NEEDS_MONITORING
def test_entry_of_the_list_that_fits_no_fault_is_an_error(project):
    file = project / 'test' / 'equivalent_mutants.txt'
    file.write_text(EQUIVALENT.replace('reverse', 'inverse'))
    status, _, error = mutate(project, 'tf_tree_py/core/gauge.py:3')
    assert status == 1 and error.startswith(f'{file}: no fault fits tf_tree_py/core/gauge.py beep')
    file.write_text(EQUIVALENT.replace('  why', '  because'))
    assert 'an entry has not the form' in mutate(project, 'tf_tree_py/core/gauge.py:3')[2]


@NEEDS_MONITORING
def test_ctrl_c_leaves_no_file_and_no_process(project):
    pid = project.parent / 'pid'
    gauge = project / 'tf_tree_py' / 'core' / 'gauge.py'
    program = Program(sys.executable, str(project / 'test' / 'mutate.py'), f'{gauge}:3',
                      f'{gauge}:11', env=environment(project), own_terminal=True)
    try:
        program.wait_for('->  pass  caught by')
        # The next fault hangs.
        pid.unlink()
        until(lambda: pid.exists() and pid.read_text())
        program.interrupt()
        assert program.end() == 130
    finally:
        program.kill()
    assert program.output.count('->  pass  caught by') == 1
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)
    assert_nothing_is_left(project)
