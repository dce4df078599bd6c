# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Missing requirements for building tf2_msgs are reported first; no ROS is needed for that."""

import sys

import pytest
from tf_tree_py.interfaces.__main__ import main
from tf_tree_py.interfaces.building import build, CannotBuild, find


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """Return an environment that appears to contain the generators."""
    (tmp_path / 'share' / 'rosidl_generator_py').mkdir(parents=True)
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    return tmp_path


def test_environment_without_wheels_is_told_what_to_install(tmp_path):
    with pytest.raises(CannotBuild, match=r"pip install '\.\[jazzy\]'.*apt install ros-"):
        build(tmp_path)


def test_command_says_in_one_sentence_that_there_is_no_compiler(prefix, monkeypatch, capsys):
    monkeypatch.setenv('CXX', 'g++-none -m64')
    monkeypatch.setattr(sys, 'argv', ['interfaces', '--no-cache'])
    assert find() is None
    assert main() == 1
    assert capsys.readouterr().err == (
        'tf2_msgs: the build needs a C++ compiler, and there is no g++-none: sudo apt install '
        'g++\n')


def test_compiler_that_is_no_command_line_is_named(prefix, monkeypatch):
    monkeypatch.setenv('CXX', 'g++ "')
    with pytest.raises(CannotBuild, match='CXX=g[+][+] " cannot be split into words'):
        build(prefix)


def test_failure_of_a_step_shows_its_command_and_its_output(prefix, monkeypatch):
    python = prefix / 'python'
    python.write_text('#!/bin/sh\necho no rosidl_adapter in $AMENT_PREFIX_PATH\nexit 3\n')
    python.chmod(0o755)
    monkeypatch.setattr(sys, 'executable', str(python))
    monkeypatch.setenv('CXX', str(python))
    with pytest.raises(CannotBuild, match=(
            f'{python} -m tf_tree_py.interfaces.generating .* failed:\n'
            f'no rosidl_adapter in {prefix}\n')):
        build(prefix)
