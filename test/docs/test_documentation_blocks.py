# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The code in the documentation runs unchanged.

The Python blocks of a page are one program, run from top to bottom in a separate process. Each
shell block is also run as one program. The page states why a block is not run.
"""

from functools import cache
from importlib.metadata import distribution
from importlib.util import find_spec
import json
import os
from pathlib import Path
import re
import shlex
import shutil
import subprocess
import sys

from code_blocks import program, REPOSITORY
from pages import BLOCKS, LANGUAGES, PAGES
from programs import completed, PATIENCE_S, Program
import pytest

PYTHON = {page: [block for block in BLOCKS if block.page == page and block.language == 'python']
          for page in dict.fromkeys(block.page for block in BLOCKS)}
PROGRAMS = [page for page, blocks in PYTHON.items() if blocks]
LAUNCH_FILES = [block for blocks in PYTHON.values() for block in blocks
                if 'launch_ros' in block.code]
SHELL = [block for block in BLOCKS if block.language == 'bash']

# Other programs, whose options are not checked, and a file that one of them creates.
OF_OTHERS = (
    'colcon', 'git', 'pip', 'python', 'python3', 'python3.12', 'ros2', 'rosdep',
    'install/setup.bash')
# Names that need a package that is not installed everywhere.
NEEDED = {'rclpy': 'rclpy', 'tf_tree_py.bag': 'rosbags', 'tf_tree_py.fleet': 'zenoh',
          'matplotlib': 'matplotlib', 'rosbags': 'rosbags'}
# Programs that run until Ctrl-C, and what they print ten times before the test ends them.
ENDLESS = {'docs/first_node.md': 'The gripper is at'}
# The command on a lab's page: test/labs runs it, in its own process.
_LAB = re.compile(r'tf_lab [a-z-]+(  *#.*)?\n')

# A program inside a shell block.
_HERE_DOCUMENT = re.compile(r"<<'END'\n.*?\nEND$", re.DOTALL | re.MULTILINE)

# Executables whose first argument has its own help.
WITH_VERBS = {'tf_archive': ['report', 'export']}
# One process asks them all, because each would import the same again.
_ASK_FOR_HELP = """
from contextlib import redirect_stdout, suppress
from importlib.metadata import distribution
import io, json, sys

helps, verbs = {}, json.loads(sys.argv[1])
for entry in distribution('tf_tree_py').entry_points.select(group='console_scripts'):
    for verb in [[], *([each] for each in verbs.get(entry.name, []))]:
        sys.argv = [entry.name, *verb, '--help']
        with redirect_stdout(io.StringIO()) as text, suppress(SystemExit, ImportError):
            entry.load()()
        helps[' '.join([entry.name, *verb])] = text.getvalue()
print(json.dumps(helps))
"""


def _lacks(page):
    """Return the packages that a page imports, also indirectly, and that are not installed."""
    text = program(PYTHON[page])
    needed = {needed for name, needed in NEEDED.items()
              if re.search(rf'^(import|from) {name}', text, re.MULTILINE)}
    needed |= {'pandas'} if '.to_frame()' in text else set()
    return sorted(name for name in needed if find_spec(name) is None)


def _written(page, folder):
    # A launch file is a separate program, with a separate test.
    blocks = [block for block in PYTHON[page] if block not in LAUNCH_FILES]
    file = folder / Path(page).with_suffix('.py').name
    file.write_text(program(blocks))
    return file


def _run_until_ctrl_c(file, printed):
    running = Program(sys.executable, str(file))
    try:
        running.wait_for(printed, count=10)
        running.interrupt()
        return running.end(), running.output
    finally:
        running.kill()


def _run_shell(block, folder):
    script = f'set -euo pipefail\n{block.code}'
    return _run(['bash', '-c', script], REPOSITORY if 'scripts/' in block.code else folder)


def _run(command, folder):
    return subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE_S)


def _hindrance(block):
    """Return the reason why a shell block cannot run here; None if it can."""
    if 'scripts/' in block.code:
        venv = REPOSITORY / '.workspace' / 'venv'
        if Path(sys.prefix) != venv or 'TF_TREE_PY_WORKSPACE' in os.environ:
            return 'scripts/ would make another environment than that of this test'
        if 'scripts/arm' in block.code and not (venv.parent / 'arm' / '.stamp').exists():
            return 'PyBullet is not here: scripts/setup --arm'
    elif 'tf_lab' in block.code and shutil.which('tf_lab') is None:
        return 'the executables are not on the path: . scripts/env'
    return None


@pytest.mark.parametrize('page', PROGRAMS)
def test_python_of_a_page_runs_from_the_top_to_the_bottom(page, tmp_path):
    if lacking := _lacks(page):
        pytest.skip(f'needs {", ".join(lacking)}')
    file = _written(page, tmp_path)
    if page in ENDLESS:
        status, output = _run_until_ctrl_c(file, ENDLESS[page])
    else:
        done = _run([sys.executable, file.name], tmp_path)
        status, output = done.returncode, done.stdout
    assert status == 0 and 'Traceback' not in output, output


@pytest.mark.parametrize('block', LAUNCH_FILES, ids=str)
def test_launch_file_describes_what_is_launched(block):
    pytest.importorskip('launch_ros')
    names = {}
    exec(compile(block.code, str(block), 'exec'), names)
    assert names['generate_launch_description']().entities


@pytest.mark.parametrize('block', [
    block for block in SHELL if not (block.not_run or _LAB.fullmatch(block.code))], ids=str)
def test_shell_block_runs(block, tmp_path):
    if hindrance := _hindrance(block):
        pytest.skip(hindrance)
    done = _run_shell(block, tmp_path)
    assert done.returncode == 0 and 'Traceback' not in done.stdout, done.stdout


@pytest.mark.parametrize('block', SHELL, ids=str)
def test_commands_of_a_shell_block_are_there(block):
    """Blocks that are not run are also checked: each program exists and has the options."""
    checked = completed('bash', '-n', '-c', block.code)
    assert (checked.returncode, checked.stderr) == (0, '')
    for line in _HERE_DOCUMENT.sub('', block.code).splitlines():
        # The rest is for ROS, or another program's command line.
        own = re.split('--ros-args| -- ', line)[0]
        words = shlex.split(own, comments=True)
        while words and (words[0] in ('.', 'export') or re.fullmatch(r'[A-Z_]+=\w+', words[0])):
            words = words[1:]
        if not words:
            continue
        name, *arguments = _without_ros2_run(words)
        if name.startswith('scripts/'):
            assert (REPOSITORY / name.rstrip(';')).exists(), line
            known = _options_of(name.rstrip(';'))
            assert _options(arguments) <= known, line
        elif name in _executables():
            asked = ' '.join([name, *arguments[:1]]) if name in WITH_VERBS else name
            assert _options(arguments) <= _options(_helps()[asked]), line
        else:
            assert name in OF_OTHERS or name.startswith('PYTHONPATH='), line


def _without_ros2_run(words):
    return words[3:] if words[:3] == ['ros2', 'run', 'tf_tree_py'] else words


def _executables():
    return {entry.name for entry in
            distribution('tf_tree_py').entry_points.select(group='console_scripts')}


def _options_of(script):
    texts = [(REPOSITORY / script).read_text()]
    if script == 'scripts/arm':
        texts += [(REPOSITORY / 'examples' / 'arm' / f'{name}.py').read_text()
                  for name in ('command', 'options')]
    if script == 'scripts/bench':
        texts.append((REPOSITORY / 'benchmark' / 'options.py').read_text())
    if script == 'scripts/demo':
        texts.append((REPOSITORY / 'tf_tree_py' / 'nodes' / 'five_frame_demo.py').read_text())
    return {word for text in texts for word in re.findall(r'--[a-z][a-z-]*', text)}


def _options(words):
    """Return the options in a text, or among some words."""
    return set(re.findall(r'--[a-z][a-z-]*', words if isinstance(words, str) else ' '.join(words)))


@cache
def _helps():
    """Return the help of every executable and verb, by its words."""
    done = subprocess.run([sys.executable, '-c', _ASK_FOR_HELP, json.dumps(WITH_VERBS)],
                          stdout=subprocess.PIPE, text=True, check=True, timeout=PATIENCE_S)
    return json.loads(done.stdout)


def test_every_help_has_examples_with_options_and_parameters_that_it_describes():
    helps = {name: _helps()[name] for name in _executables()}
    assert len(helps) == 23  # view_frames is tf_frames
    for name, text in helps.items():
        if not text:
            assert find_spec('rclpy') is None, name
            continue
        _, heading, rest = text.partition('examples:\n')
        assert heading, name
        examples, _, parameters = rest.partition('\n\n')
        for line in examples.splitlines():
            assert line.startswith(f'  {name.replace("view_frames", "tf_frames")}'), line
            own = line.strip().split('   ')[0].split('--ros-args')[0]
            asked = ' '.join(own.split()[:2]) if name in WITH_VERBS else name
            described, _, _ = _helps()[asked].partition('examples:\n')
            assert _options(own.split(' -- ')[0]) <= _options(described), line
            for parameter in re.findall(r'-p ([\w.]+):=', line):
                assert f'  {parameter} (default ' in parameters, line


def test_every_block_says_what_it_is():
    assert len(BLOCKS) > 40
    assert not [str(block) for block in BLOCKS if block.language not in LANGUAGES]


def test_few_blocks_are_not_run_and_each_says_why():
    for page in PAGES:
        said = page.read_text().count('<!-- not run')
        # A reason is at least a sentence with a word or two.
        reasons = [block.not_run for block in BLOCKS
                   if block.page == page.relative_to(REPOSITORY).as_posix() and block.not_run]
        assert said == len(reasons) <= 5 and all(len(reason) > 10 for reason in reasons), page
    assert not [str(block) for block in BLOCKS if block.not_run and block.language != 'bash']


def test_links_between_pages_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r'\]\(\s*([^)#]+?)(?:#[^)]*)?\)', page.read_text()):
            if not target.startswith('http'):
                assert (page.parent / target).exists(), f'{page}: {target}'


def test_readme_and_index_lead_to_every_page():
    pages = {page.name for page in PAGES if page.parent.name == 'docs'} - {'index.md'}
    for index, folder in (('README.md', 'docs/'), ('docs/index.md', '')):
        text = (REPOSITORY / index).read_text()
        assert not [page for page in pages if f']({folder}{page})' not in text], index


def test_tests_and_files_that_pages_name_are_there():
    tests = {name for file in (REPOSITORY / 'test').rglob('*.py')
             for name in re.findall(r'def (test_\w+)', file.read_text())}
    for page in PAGES:
        text = page.read_text()
        assert not set(re.findall(r'`(test_\w+)`', text)) - tests, page
        for file in re.findall(r'`((?:benchmark|config|docs|examples|test)/[\w/.]+)`', text):
            assert 'my_name' in file or (REPOSITORY / file).exists(), f'{page}: {file}'


def test_index_names_every_program():
    index = (REPOSITORY / 'docs' / 'index.md').read_text()
    assert not [name for name in _executables() if f'`{name}`' not in index]
