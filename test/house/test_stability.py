# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The public names that docs/stability.md lists are those of ``__all__`` and of the reference."""

import ast
import importlib
import inspect
from pathlib import Path
import re

import house
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core.buffer.plain_buffer import PlainBuffer

REPOSITORY = Path(__file__).parents[2]
PAGE = (REPOSITORY / 'docs' / 'stability.md').read_text()
PUBLIC = re.findall(r'^\| `(tf_tree_py[\w.]*)` \|', PAGE, flags=re.MULTILINE)


def test_list_of_public_modules_has_its_known_members():
    assert {'tf_tree_py', 'tf_tree_py.core', 'tf_tree_py.bag'} <= set(PUBLIC)


@pytest.mark.parametrize('name', PUBLIC)
def test_public_module_lists_its_names_sorted_and_has_them(name):
    module = importlib.import_module(name)
    assert module.__all__ == sorted(set(module.__all__), key=str.lower)
    assert all(getattr(module, public) is not None for public in module.__all__)


def test_reference_begins_with_every_public_module():
    pages = re.findall(r'api/(tf_tree_py[\w.]*)\.md', (REPOSITORY / 'mkdocs.yml').read_text())
    assert set(PUBLIC) <= set(pages)
    internal = [page for page in pages
                if page not in PUBLIC and page.rpartition('.')[0] not in PUBLIC[:1]
                and page != 'tf_tree_py.core']
    assert max(map(pages.index, PUBLIC)) < min(map(pages.index, internal))


def test_every_page_of_internals_has_its_module():
    internals = (REPOSITORY / 'mkdocs.yml').read_text().partition('- Internals:')[2]
    pages = re.findall(r'api/(tf_tree_py[\w.]*)\.md', internals)
    assert pages
    paths = [REPOSITORY.joinpath(*page.split('.')) for page in pages]
    assert all(path.is_dir() or path.with_suffix('.py').exists() for path in paths), pages


def test_every_package_with_names_is_public_or_internal():
    packages = (REPOSITORY / 'tf_tree_py').glob('*/__init__.py')
    listed = {f'tf_tree_py.{path.parent.name}' for path in packages
              if re.search(r'^__all__', path.read_text(), flags=re.MULTILINE)}
    assert listed <= set(PUBLIC)


def parameters_of(documented):
    """Return the description of each parameter in a docstring."""
    return dict(re.findall(r'^:param (\w+):(.*?)(?=^:|^$|\Z)', inspect.getdoc(documented),
                           flags=re.MULTILINE | re.DOTALL))


@pytest.mark.parametrize(('plain', 'full'), [
    (PlainBuffer, BufferCore), (PlainBuffer.insert, BufferCore.insert)],
    ids=['the class', 'insert'])
def test_buffer_core_describes_every_parameter_as_the_plain_buffer_does(plain, full):
    described = parameters_of(plain)
    assert described
    assert described.items() <= parameters_of(full).items()


def test_no_class_has_methods_for_type_checkers_only():
    """They would hide the docstrings of the methods that they repeat from the reference."""
    hidden = [f'{path}: {cls.name}' for path in house.files()
              for cls in ast.walk(ast.parse(path.read_text())) if isinstance(cls, ast.ClassDef)
              for part in cls.body if isinstance(part, ast.If)]
    assert not hidden
