# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What is public shows at a glance: modules with ``__all__`` are public, and no others.

In all other modules, a name without an underscore is used by other files, and one with an
underscore only by its own.
"""

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path
import re

import house

REPOSITORY = Path(__file__).parents[2]
PAGE = (REPOSITORY / 'docs' / 'stability.md').read_text()
PUBLIC = set(re.findall(r'^\| `(tf_tree_py[\w.]*)` \|', PAGE, flags=re.MULTILINE))

# Names that nothing in this repository writes, and who uses them.
USED_ELSEWHERE = {
    'tools/ros2_verbs.py': 'the command ros2 loads them',
    'tools/archive/ignore_ctrl_c.py': 'dask calls it',
    'ros/messages/do_transform.py': "a decorator registers them under tf2_geometry_msgs's names",
}


def modules():
    """Return our files by the names under which they are imported."""
    found = {'.'.join(('tf_tree_py', *house.parts(path))): path for path in house.files()}
    return found | {'tf_tree_py': house.PACKAGE / '__init__.py'}


def bound(statement):
    """Return the functions and constants that a statement of a module defines."""
    if isinstance(statement, ast.FunctionDef):
        return [statement.name]
    targets = (statement.targets if isinstance(statement, ast.Assign)
               else [statement.target] if isinstance(statement, ast.AnnAssign) else [])
    return [target.id for target in targets if isinstance(target, ast.Name)]


@cache
def users():
    """Return the files in which each word stands."""
    found = defaultdict(set)
    for folder in ('tf_tree_py', 'test', 'docs', 'examples', 'benchmark', 'scripts', '.'):
        files = (REPOSITORY / folder).glob('*' if folder == '.' else '**/*')
        for path in files:
            if path.suffix in ('.py', '.md', '.toml', '.cfg', '.yml') and path.is_file():
                for word in set(re.findall(r'\w+', path.read_text(encoding='utf-8'))):
                    found[word].add(path)
    return found


def test_modules_with_all_are_the_public_ones():
    having = {name for name, path in modules().items()
              if re.search(r'^__all__\b', path.read_text(), flags=re.MULTILINE)}
    assert having == PUBLIC


def test_names_of_one_file_have_an_underscore():
    wrong = []
    for module, path in modules().items():
        if module in PUBLIC or path.relative_to(house.PACKAGE).as_posix() in USED_ELSEWHERE:
            continue
        for statement in ast.parse(path.read_text()).body:
            wrong += [f'{module}.{name}' for name in bound(statement)
                      if not name.startswith('_') and not users()[name] - {path}]
    assert not wrong


def test_names_with_an_underscore_stay_in_their_file():
    wrong = [f'{module} imports {imported}' for module, path in modules().items()
             for level, imported in house.imports_of(path)
             if (level or imported.startswith('tf_tree_py'))
             and re.match(r'_(?!_)', imported.rpartition('.')[2])]
    assert not wrong
