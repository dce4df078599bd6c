# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tests use the names that other files may use: so the code behind them can change."""

import ast
from collections import Counter
from pathlib import Path
import re

TESTS = Path(__file__).parents[1]
MOST = 41
# Of named tuples, of notebooks, and of the standard library, whose documentation lists them.
PUBLIC = {'_replace', '_make', '_asdict', '_fields', '_field_defaults', '_repr_html_',
          '_repr_svg_', '_repr_mimebundle_', '_getframe', '_current_frames', '_exit'}


def is_private(name):
    """Return whether a name begins with one underscore; also a dotted one, by its last part."""
    return (re.fullmatch(r'_[A-Za-z]\w*', name.rpartition('.')[2]) is not None
            and name.rpartition('.')[2] not in PUBLIC)


def own_names(tree):
    """Return the names that a file gives to something itself: classes, functions, variables."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) in ('self', 'cls'):
            yield node.attr


def names_in_strings(call):
    """Yield the names that a call replaces or reads, of those of ``setattr`` and the like."""
    if ast.unparse(call.func).rpartition('.')[2] in ('setattr', 'getattr', 'delattr', 'object'):
        for argument in call.args:
            first = argument.values[0] if isinstance(argument, ast.JoinedStr) else argument
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                yield first.value


def private_names(source):
    """
    Yield the private names of others that a test file uses, once for each use.

    They are attributes, imports, and strings for ``setattr`` and the like. A name is private if it
    begins with one underscore and the file does not define it itself.
    """
    tree = ast.parse(source)
    own = {*own_names(tree)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            names = [node.attr]
        elif isinstance(node, ast.ImportFrom):
            names = [alias.name for alias in node.names]
        else:
            names = names_in_strings(node) if isinstance(node, ast.Call) else []
        yield from (name for name in names if is_private(name) and name not in own)


def test_uses_of_private_names_are_found():
    source = """
from a import _imported, public, __dunder__
_mine, __author__ = 1, 'me'
class Own:
    async def _method(self):
        self._attribute = other._attribute
        return other._method(), other._mine
other._read, other.__dict__, pair._replace(a=1), os._exit(0)
monkeypatch.setattr(other, '_set', 1)
monkeypatch.setattr('a.b._PATH', 1)
monkeypatch.setattr(other, f'_set_{name}', 1)
print('_text')
"""
    assert sorted(private_names(source)) == [
        '_imported', '_read', '_set', '_set_', 'a.b._PATH']


def test_tests_use_few_private_names_of_others():
    """Test what others see, or let one helper use the name for all; or it is not private."""
    used = Counter({str(path.relative_to(TESTS)): len([*private_names(path.read_text())])
                    for path in TESTS.rglob('*.py') if 'data' not in path.parts})
    assert used.total() <= MOST, +used
