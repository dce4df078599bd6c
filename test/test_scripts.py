# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The scripts: workspaces made for another folder, progress, verdicts, and tests that crash."""

import os
from pathlib import Path
import shutil
import subprocess
import sys
import textwrap

from programs import completed, PATIENCE_S
import pytest

SCRIPTS = Path(__file__).resolve().parents[1] / 'scripts'


@pytest.fixture
def clone(tmp_path):
    """Return a clone with a workspace that contains only the stamps and the sourced files."""
    clone = tmp_path / 'clone'
    (clone / 'scripts').mkdir(parents=True)
    for name in ('lib.sh', 'print-env'):
        shutil.copy(SCRIPTS / name, clone / 'scripts')
    setup = clone / 'scripts' / 'setup'
    setup.write_text('#!/bin/sh\necho set up anew "$@"\n')
    setup.chmod(0o755)
    workspace = clone / '.workspace'
    for folder, stamp in (('', 'abc'), ('setup/tools', 'def'),
                          ('setup/tf_tree_py', f'{clone} ghi')):
        (workspace / 'venv' / folder).mkdir(parents=True, exist_ok=True)
        (workspace / 'venv' / folder / '.stamp').write_text(f'{workspace} {stamp}\n')
    return clone


def print_env(clone, **variables):
    """Run scripts/print-env as a user without ROS; return its two outputs."""
    done = subprocess.run([clone / 'scripts' / 'print-env'], capture_output=True, text=True,
                          timeout=PATIENCE_S, check=True, env={'PATH': os.defpath, **variables})
    return done.stdout, done.stderr


def test_workspace_is_entered_as_it_is(clone):
    out, err = print_env(clone)
    assert err == '' and f'{clone}/.workspace/venv/bin' in out


def test_workspace_that_was_copied_is_made_anew(clone):
    copy = shutil.copytree(clone, clone.with_name('copy'))
    out, err = print_env(copy)
    assert 'was made for another folder (was this one copied or moved?)' in err
    assert 'set up anew' in err
    assert f'{copy}/.workspace/venv/bin' in out and str(clone) not in out


def test_tools_are_installed_when_the_environment_is_entered(clone):
    (clone / '.workspace' / 'venv' / 'setup' / 'tools' / '.stamp').unlink()
    assert print_env(clone)[1] == 'set up anew --tools\n'


def test_setup_that_was_interrupted_is_only_continued(clone):
    (clone / '.workspace' / 'venv' / 'setup' / 'tf_tree_py' / '.stamp').unlink()
    assert print_env(clone)[1] == 'set up anew\n'


def test_workspace_that_was_moved_is_made_anew(clone, tmp_path):
    elsewhere = shutil.move(clone / '.workspace', tmp_path / 'elsewhere')
    assert 'set up anew' in print_env(clone, TF_TREE_PY_WORKSPACE=str(elsewhere))[1]


def test_long_step_of_setup_says_how_long_it_takes_until_it_ends():
    text = (SCRIPTS / 'setup').read_text()
    begin = text.index('count_seconds() {')
    function = text[begin:text.index('\n}\n', begin) + 3].replace('-rt 20', '-rt 0.01')
    program = f'say() {{ echo "$*"; }}\n{function}\ncount_seconds installing'
    with subprocess.Popen(['bash', '-c', program], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == 'installing: 20 s so far\n'
        assert process.stdout.readline() == 'installing: 40 s so far\n'
        process.stdin.close()
        assert process.wait(PATIENCE_S) == 0


def test_clone_is_the_same_through_a_link(clone, tmp_path):
    link = tmp_path / 'link'
    link.symlink_to(clone)
    assert print_env(link)[1] == ''


LINTERS = {
    'ruff': '', 'ament_flake8': '', 'codespell': '', 'python': '', 'ament_xmllint': '',
    'shellcheck': '',
    'mypy': 'echo "a.py:1: error: wrong type"; exit 1',
    'ament_pep257': 'echo "checking ./a.py"; echo "./a.py:1: D400" >&2; '
                    'printf "\\nChecked files:\\n* ./b.py\\n"; exit 1',
}


def test_check_says_which_linters_failed_and_hides_files_without_a_fault(clone):
    folder = clone / '.workspace' / 'venv' / 'bin'
    folder.mkdir()
    shutil.copy(SCRIPTS / 'check', clone / 'scripts')

    def check(linters):
        for name, text in linters.items():
            (folder / name).write_text(f'#!/bin/sh\n{text}\n')
            (folder / name).chmod(0o755)
        done = completed(clone / 'scripts' / 'check', env={'PATH': os.defpath})
        return done.returncode, done.stdout, done.stderr.splitlines()[-1]

    status, output, verdict = check(LINTERS)
    assert (status, verdict) == (1, 'tf_tree_py: 2 of 8 failed: mypy, ament_pep257')
    assert 'a.py:1: error: wrong type\n' in output and './a.py:1: D400\n' in output
    assert 'checking' not in output and 'Checked' not in output and 'b.py' not in output
    status, output, verdict = check(dict.fromkeys(LINTERS, ''))
    assert (status, verdict) == (0, 'tf_tree_py: all 8 passed')


# A project with test/unfinished.py; each line of its file `ran` is a test that ran.
CRASHING = {
    'conftest': """
        from pathlib import Path

        import pytest
        from unfinished import Unfinished

        def pytest_configure(config):
            config.pluginmanager.register(Unfinished())

        @pytest.fixture(autouse=True)
        def times(request):
            ran = Path(__file__).with_name('ran')
            with ran.open('a') as file:
                print(request.node.name, file=file)
            return ran.read_text().split().count(request.node.name)
        """,
    'test_a': """
        def test_passes(): pass
        def test_fails_once(times): assert times > 1
        def test_fails_once_too(times): assert times > 1
        """,
    'test_b': """
        import os
        def test_crashes(times): times > CRASHES or os.abort()
        def test_behind(): pass
        """,
    'test_c': 'def test_of_another_file(): pass',
}


@pytest.mark.parametrize('crashes', [1, 2])
def test_crash_leaves_no_test_that_did_not_run(tmp_path, crashes):
    pytest.importorskip('xdist')
    for name, text in CRASHING.items():
        text = textwrap.dedent(text).replace('CRASHES', str(crashes))
        (tmp_path / f'{name}.py').write_text(text)
    text = (SCRIPTS / 'test').read_text()
    functions = text[text.index('run_pytest() {'):text.index('export PYTEST_XDIST')]
    program = f"""
        say() {{ echo "$*"; }}
        again=yes
        limits=()
        workers=(-n 1 --dist loadfile --max-worker-restart 0)
        {functions}
        run_pytest {sys.executable}
        """
    env = {name: value for name, value in os.environ.items() if not name.startswith('PYTEST_')}
    done = completed('bash', '-c', program, cwd=tmp_path,
                     env={**env, 'PYTHONPATH': os.pathsep.join(sys.path)})
    first = ['test_passes', 'test_fails_once', 'test_fails_once_too', 'test_crashes']
    second = first[1:]
    rest = ['test_behind', 'test_of_another_file']
    assert 'a test process crashed' in done.stdout
    assert (tmp_path / 'ran').read_text().split() == first + second + rest * (crashes == 1)
    assert done.returncode == 40, 'it fails, whatever happens the second time'


@pytest.mark.parametrize('options', [['--help'], ['-h'], ['--quick', '--only', 'wait', '--help']])
def test_help_of_the_benchmark_installs_nothing(tmp_path, options):
    workspace = tmp_path / 'workspace'
    workspace.mkdir()
    done = subprocess.run(
        [SCRIPTS / 'bench', *options], capture_output=True, text=True, timeout=PATIENCE_S,
        check=True, env={'PATH': os.defpath, 'TF_TREE_PY_WORKSPACE': str(workspace)})
    assert done.stdout.startswith('usage: scripts/bench') and '--only GROUP' in done.stdout
    assert done.stderr == ''
    assert list(workspace.iterdir()) == []


@pytest.mark.parametrize(('options', 'steps'), [
    ([], ['installing PyBullet (200 MB)', 'installing what makes the site (50 MB)']),
    (['--docs'], ['installing what makes the site (50 MB)'])])
def test_help_of_setup_lists_downloads_and_installs_nothing(tmp_path, options, steps):
    workspace = tmp_path / 'workspace'
    done = subprocess.run(
        [SCRIPTS / 'setup', *options, '--help'], capture_output=True, text=True,
        timeout=PATIENCE_S, check=True, env={'PATH': os.defpath, 'HOME': str(tmp_path),
                                             'TF_TREE_PY_WORKSPACE': str(workspace)})
    listed = done.stdout.partition(f'not done yet in {workspace}, ')[2].splitlines()[1:]
    assert {f'  {step}' for step in steps} <= set(listed)
    assert len(listed) == 1 or not options
    assert done.stderr == '' and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(('arguments', 'python', 'said'), [
    ([], '/bin/false', 'PYTHON=/bin/false is none of 3.12, 3.13, 3.14, 3.11, 3.10, or does not'),
    (['--oldest'], '/bin/false', 'PYTHON=/bin/false is none of 3.12, 3.11, 3.10, or does not'),
    (['--toolz'], '', 'there is no option --toolz'),
    (['--tools', '--distro', 'kilted'], '', '--distro NAME comes before the other options'),
    (['--python', '--help'], '', "--python takes a version, such as 3.13, not '--help'"),
    (['--python'], '', "--python takes a version, such as 3.13, not ''")])
def test_what_setup_cannot_do_is_one_sentence_and_removes_nothing(
        tmp_path, arguments, python, said):
    kept = tmp_path / 'venv' / '.stamp'
    kept.parent.mkdir()
    kept.write_text('made earlier')
    done = completed(
        SCRIPTS / 'setup', *arguments,
        env={'PATH': os.defpath, 'HOME': str(tmp_path), 'PYTHON': python,
             'TF_TREE_PY_WORKSPACE': str(tmp_path)})
    assert done.returncode == 1
    [line] = done.stderr.splitlines()
    assert line.startswith(f'tf_tree_py: {said}')
    assert kept.read_text() == 'made earlier'


@pytest.mark.parametrize(('there', 'taken'), [
    ('3.10 3.11 3.12 3.13 3.14', '3.12'), ('3.10 3.11 3.13 3.14', '3.13'),
    ('3.10 3.11 3.14', '3.14'), ('3.10 3.11', '3.11'), ('3.10', '3.10'), ('3.9', '')])
def test_python_of_the_wheels_is_the_first_that_is_there(tmp_path, there, taken):
    for version in there.split():
        # It stands for a Python that fulfils every condition.
        python = tmp_path / f'python{version}'
        python.write_text('#!/bin/sh\necho "$0"\n')
        python.chmod(0o755)
    program = f"""
        workspace=/nowhere uv=false
        . {SCRIPTS / 'pythons.sh'}
        PATH={tmp_path} installed_python_of_wheels
        """
    done = completed('bash', '-c', program, env={'PATH': os.defpath, 'PYENV_ROOT': '/nowhere'})
    assert done.stdout == (f'{tmp_path}/python{taken}\n' if taken else '')
    assert done.returncode == (0 if taken else 1)
