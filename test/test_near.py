# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""``scripts/test --near`` selects the tests that concern a change."""

import near
import pytest

FILES = {
    'tf_tree_py/core/gauge.py': '',
    'tf_tree_py/ros/board.py': 'from tf_tree_py.core.gauge import gauge',
    'tf_tree_py/ros/lamp.py': '',
    'tf_tree_py/tools/__init__.py': '',
    'tf_tree_py/tools/switches.py': '',
    'tf_tree_py/tools/tf_gauge.py': '',
    # This one starts no process.
    'test/core/test_chain.py': 'import tf_tree_py.ros.board',
    # These start processes.
    'test/ros/test_board.py': 'import subprocess\nimport tf_tree_py.ros.board',
    'test/tools/test_far.py': 'import subprocess\nimport tf_tree_py.ros.board',
    'test/tools/test_helped.py': 'import helper',
    'test/tools/test_commands.py': 'import subprocess\nfrom commands import run',
    'test/tools/test_words.py': '"""It has no __init__, and its switches are few."""',
    'test/helper.py': '"""It reads tf_tree_py/ros/lamp.py."""\nimport subprocess',
    'test/tools/commands.py': 'run = ["tf_gauge"]',
}


@pytest.fixture
def selected(tmp_path, monkeypatch):
    """Return a function of a file of ``FILES``: the names of the tests that it selects."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(near, 'REPOSITORY', tmp_path)
    monkeypatch.setattr(near, 'TESTS', tmp_path / 'test')
    return lambda name: {test.stem for *_, test in near.near({tmp_path / name})}


def test_chain_of_imports_selects_a_test_that_starts_no_process(selected):
    assert selected('tf_tree_py/core/gauge.py') == {'test_chain'}


def test_import_selects_a_test_that_starts_processes_only_in_its_own_layer(selected):
    assert selected('tf_tree_py/ros/board.py') == {'test_chain', 'test_board'}


def test_file_that_only_a_helper_names_selects_the_tests_that_use_it(selected):
    assert selected('tf_tree_py/ros/lamp.py') == {'test_helped'}


def test_command_that_only_a_helper_runs_selects_the_tests_that_use_it(selected):
    assert selected('tf_tree_py/tools/tf_gauge.py') == {'test_commands'}


@pytest.mark.parametrize('name', ['__init__', 'switches'])
def test_word_that_is_also_a_file_of_the_tools_selects_nothing(name, selected):
    assert selected(f'tf_tree_py/tools/{name}.py') == set()


def test_change_of_the_diagnostics_selects_the_table_of_verdicts():
    changed = near.PACKAGE / 'ros' / 'diagnostics.py'
    assert changed.is_file()
    assert near.is_named(changed, near.TESTS / 'tools' / 'test_verdicts.py')
