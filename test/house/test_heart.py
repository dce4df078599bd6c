# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The heart works alone, and what does not use a room beyond it works without that room."""

import ast
from functools import cache
from pathlib import Path
import shutil
import subprocess
import sys

import house
from programs import PATIENCE_S
import pytest

TESTS = Path(__file__).parents[1]


def run(program, *folders):
    """Run a program that finds modules only in these folders, and return what it prints."""
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, check=False,
        timeout=PATIENCE_S, cwd=folders[0],
        env={'PYTHONPATH': ':'.join(map(str, folders)), 'PATH': '/usr/bin:/bin'})
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


# --- the heart alone

ALONE = """
import importlib, pkgutil, sys
sys.modules['tf_tree_py'] = None  # even where the package is installed

import core
from core.geometry.so3 import with_tf2_sign
from recordings import problems_of, RECORDINGS, Replay

for module in pkgutil.walk_packages(core.__path__, 'core.'):
    importlib.import_module(module.name)
for recording in RECORDINGS:
    answers, problems = problems_of(Replay(core.PlainBuffer, with_tf2_sign), recording)
    assert answers > 0
    assert not problems, problems[:5]
print(len(RECORDINGS))
"""


def test_copied_alone_it_answers_what_tf2_answered(tmp_path):
    shutil.copytree(house.PACKAGE / 'core', tmp_path / 'core',
                    ignore=shutil.ignore_patterns('__pycache__', '*.so'))
    assert run(ALONE, tmp_path, TESTS) == '14\n'


# --- a room taken away

ROOMS = [f'beyond/{room}' for room in house.LAYERS['beyond'].rooms.split()]
# The files that put the package together, from which the names of a room are taken out.
ASSEMBLED = {'buffer_core.py', '__init__.py'}


class Without(ast.NodeTransformer):
    """Takes out of a file what it imports from modules that are gone, and where it uses that."""

    def __init__(self, gone):
        self.gone = gone
        self.names = set()

    def visit_ImportFrom(self, node):
        if node.module not in self.gone:
            return node
        self.names |= {alias.name for alias in node.names}
        return None

    def visit_ClassDef(self, node):
        node.bases = [base for base in node.bases if ast.unparse(base) not in self.names]
        return self.generic_visit(node)

    def visit_List(self, node):
        node.elts = [item for item in node.elts
                     if not (isinstance(item, ast.Constant) and item.value in self.names)]
        return node

    visit_Set = visit_List


def dotted(places):
    """Return the names under which modules are imported."""
    return sorted('.'.join(('tf_tree_py', *place)) for place in places)


def users_of(room):
    """Return the files of a room, and all that import one of them, directly or not."""
    gone = {place for place in house.modules() if house.room_of(place) == room}
    assembled = {place for place, path in house.modules().items() if path.name in ASSEMBLED
                 and path.parent == house.PACKAGE}
    while True:
        more = {place for place, path in house.modules().items()
                if place not in gone | assembled and not gone.isdisjoint(house.imported(path))}
        if not more:
            return gone
        gone |= more


def copy_without(gone, folder):
    """
    Copy the package without some modules.

    Return those that are left and need only numpy and scipy.
    """
    copy = folder / 'tf_tree_py'
    shutil.copytree(house.PACKAGE, copy, ignore=shutil.ignore_patterns('__pycache__'))
    for place in gone:
        (copy / house.modules()[place].relative_to(house.PACKAGE)).unlink()
    for name in ASSEMBLED:
        tree = ast.parse((copy / name).read_text())
        change = Without(dotted(gone))
        (copy / name).write_text(ast.unparse(change.visit(tree)))
    return [place for place in house.modules().keys() - gone if needs_no_extras(place[0])]


def needs_no_extras(layer):
    needs = house.LAYERS[layer].needs
    return needs is not None and set(needs.split()) <= {'numpy', 'scipy'}


# Each test runs with one of its cases: if it misses the room, so does any, and all cases are
# tried with the room there.
LEFT = """
import importlib, os, sys
import pytest

for name in {left}:
    importlib.import_module(name)
assert sys.modules['tf_tree_py'].__file__.startswith(os.getcwd())


class OneCase:

    def pytest_collection_modifyitems(self, items):
        kept = dict()
        for item in items:
            kept.setdefault(item.nodeid.partition('[')[0], item)
        items[:] = kept.values()


sys.exit(pytest.main({options} + {tests}, plugins=[OneCase()]))
"""
OPTIONS = ['-q', '-p', 'no:xdist', '-p', 'no:cacheprovider', '--hypothesis-profile', 'brief']


@cache
def nodes_of(path):
    """Return the nodes of the syntax of a file."""
    return [*ast.walk(ast.parse(path.read_text()))]


def names_of(places):
    """Return the functions and classes that modules define."""
    return {node.name for place in places for node in nodes_of(house.modules()[place])
            if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def names_in(path):
    """Return the names that a test imports, and those of the attributes that it uses."""
    return {name for node in nodes_of(path)
            for name in (getattr(node, 'attr', None), getattr(node, 'name', None))}


def file_of(name):
    return next(TESTS.glob(f'**/{name}'))


def chosen_without(room, gone, left):
    """Return the tests that import none of these modules, and call nothing of the room."""
    only_there = names_of(place for place in gone if house.room_of(place) == room) - names_of(left)
    found = []
    for name in TESTS_OF_ROOMS:
        path = file_of(name)
        imported = {node.module for node in nodes_of(path) if isinstance(node, ast.ImportFrom)}
        if imported.isdisjoint(dotted(gone)) and not names_in(path) & only_there:
            found.append(name)
    return found


# Tests of the heart and of each room, which take a second or two at most.
TESTS_OF_ROOMS = [
    'test_aided.py', 'test_buffer_core.py', 'test_companions.py', 'test_conformance.py',
    'test_covariances.py', 'test_curves.py', 'test_deskew.py', 'test_framed_pose.py',
    'test_gating.py', 'test_prediction.py', 'test_sources.py', 'test_tree.py', 'test_twist.py',
    'test_uncertain.py']


@pytest.mark.parametrize('room', ROOMS)
def test_without_a_room_what_does_not_use_it_imports_and_passes(room, tmp_path):
    gone = users_of(room)
    left = copy_without(gone, tmp_path)
    tests = chosen_without(room, gone, left)
    assert {'test_conformance.py', 'test_tree.py'} <= set(tests)
    run(LEFT.format(left=dotted(left), options=OPTIONS,
                    tests=[str(file_of(name)) for name in tests]), tmp_path, TESTS)
