# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Missing requirements for building tf2_msgs are reported first; no ROS is needed for that."""

import sys
import sysconfig

import pytest
from tf_tree_py.interfaces.__main__ import main
from tf_tree_py.interfaces.building import build, CannotBuild, find
from tf_tree_py.interfaces.cmake_exports import repair


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    """Return an environment that appears to contain the generators."""
    (tmp_path / 'share' / 'rosidl_default_generators').mkdir(parents=True)
    monkeypatch.setattr(sys, 'prefix', str(tmp_path))
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    return tmp_path


def test_environment_without_jazzy_is_told_what_to_install(tmp_path):
    with pytest.raises(CannotBuild, match=r"pip install '\.\[jazzy\]'.*apt install ros-"):
        build(tmp_path)


def test_command_says_it_in_one_sentence(prefix, monkeypatch, capsys):
    monkeypatch.setenv('PATH', '/nowhere')
    monkeypatch.delenv('CXX', raising=False)
    monkeypatch.setattr(sys, 'argv', ['interfaces'])
    assert find() is None
    assert main() == 1
    assert capsys.readouterr().err == (
        'tf2_msgs: the build needs a C++ compiler: sudo apt install g++\n')


def test_failure_of_cmake_shows_what_it_said(prefix, monkeypatch):
    cmake = prefix / 'bin' / 'cmake'
    cmake.parent.mkdir()
    cmake.write_text('#!/bin/sh\necho no ament_cmake in $AMENT_PREFIX_PATH\nexit 3\n')
    cmake.chmod(0o755)
    monkeypatch.setenv('CXX', str(cmake))
    with pytest.raises(CannotBuild, match=f'cmake -S failed:\nno ament_cmake in {prefix}\n'):
        build(prefix)


def test_folders_of_another_machine_give_way_and_links_stay_as_they_are(prefix):
    kept = prefix / 'cache'
    kept.write_text('set(include "/opt/python/cp312-cp312/include/python3.12;/usr/include")\n'
                    'set(numpy "/opt/python/cp312-cp312/lib/python3.12/site-packages/numpy/_core'
                    '/include")\n')
    before = kept.read_text()
    export = prefix / 'share' / 'some_msgs' / 'cmake' / 'some_msgsExport.cmake'
    export.parent.mkdir(parents=True)
    export.hardlink_to(kept)
    repair(prefix)
    include = sysconfig.get_paths()['include']
    assert f'"{include};/usr/include"' in export.read_text()
    assert '/opt/python' not in export.read_text()
    assert kept.read_text() == before
