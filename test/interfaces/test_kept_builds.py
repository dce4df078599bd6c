# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Builds are kept for other environments, and found where they are the same."""

import os
from pathlib import Path

import pytest
from tf_tree_py.interfaces.kept import Kept, user_cache


@pytest.fixture
def sources(tmp_path):
    file = tmp_path / 'a.msg'
    file.write_bytes(b'uint8 a \xff')
    return [file]


@pytest.fixture
def image(tmp_path):
    folder = tmp_path / 'image'
    (folder / 'lib').mkdir(parents=True)
    (folder / 'module.so').write_text('code')
    (folder / 'lib' / 'link.so').symlink_to('../module.so')
    return folder


@pytest.fixture
def cache(tmp_path):
    return tmp_path / 'home' / 'cache'


def test_build_is_found_as_it_was(cache, sources, image):
    assert Kept(cache, sources).find() is None
    Kept(cache, sources).keep(image)
    found = Kept(cache, sources).find()
    assert (found / 'module.so').read_text() == 'code'
    assert (found / 'lib' / 'link.so').readlink() == Path('../module.so')
    assert os.listdir(cache) == [found.name]


def test_build_from_other_sources_is_not_found(cache, sources, image):
    Kept(cache, sources).keep(image)
    sources[0].write_bytes(b'uint16 a')
    assert Kept(cache, sources).find() is None


def test_build_for_other_wheels_is_not_found(cache, sources, image, tmp_path, monkeypatch):
    Kept(cache, sources).keep(image)
    wheel = tmp_path / 'site' / 'ros_new-1.0.dist-info'
    wheel.mkdir(parents=True)
    (wheel / 'METADATA').write_text('Metadata-Version: 2.1\nName: ros-new\nVersion: 1.0\n')
    monkeypatch.syspath_prepend(wheel.parent)
    assert Kept(cache, sources).find() is None


def test_build_of_another_compiler_is_not_found(cache, sources, image, monkeypatch):
    Kept(cache, sources).keep(image)
    monkeypatch.setenv('CXX', 'g++ -fsanitize=undefined')
    assert Kept(cache, sources).find() is None


def test_newer_build_replaces_one_that_does_not_load(cache, sources, image):
    Kept(cache, sources).keep(image)
    (image / 'module.so').write_text('better')
    Kept(cache, sources).keep(image)
    assert (Kept(cache, sources).find() / 'module.so').read_text() == 'better'


def test_cache_that_another_user_can_write_is_ignored(cache, sources, image):
    Kept(cache, sources).keep(image)
    cache.chmod(0o770)
    assert Kept(cache, sources).find() is None


def test_cache_that_cannot_be_made_is_no_error(tmp_path, sources, image):
    file = tmp_path / 'file'
    file.touch()
    Kept(file / 'cache', sources).keep(image)
    assert Kept(file / 'cache', sources).find() is None


@pytest.mark.parametrize(('named', 'expected'), [
    ('/somewhere', '/somewhere/tf_tree_py/tf2_msgs'),
    ('relative', '/home/me/.cache/tf_tree_py/tf2_msgs'),
    ('', '/home/me/.cache/tf_tree_py/tf2_msgs')])
def test_cache_is_where_the_base_directories_have_it(monkeypatch, named, expected):
    monkeypatch.setenv('HOME', '/home/me')
    monkeypatch.setenv('XDG_CACHE_HOME', named)
    assert str(user_cache()) == expected


def test_user_without_a_home_has_no_cache(monkeypatch):
    def no_home():
        raise RuntimeError('Could not determine home directory.')

    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    monkeypatch.setattr(Path, 'home', no_home)
    assert user_cache() is None
