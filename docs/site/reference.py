# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Makes the reference of the docstrings: a page for each module and class that mkdocs.yml names.

A module's page lists its public names, and describes those that have no page of their own and
are on no page before it. The last page has the classes that all these return.
"""

from collections.abc import Iterator
import json
from pathlib import Path

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = 'tf_tree_py'
FOLDER = 'api/'
RETURNED = f'{FOLDER}returned.md'

# Guides are found before the reference, whose titles would count a thousand times as much as text.
_SEARCH = 'search:\n  boost: 0.005\n'
# Their fields speak for themselves, or are told in the docstring of the class.
_RECORDS = {'Enum', 'NamedTuple'}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the reference's pages."""
    package = griffe.load(PACKAGE, search_paths=[REPOSITORY], resolve_aliases=True)
    names = [path.removeprefix(FOLDER).removesuffix('.md') for path in _pages(config.nav)]
    subjects = {name: _found(package, name) for name in names}
    described = {subject.path: subject for subject in subjects.values()}
    for name, subject in subjects.items():
        _add(files, config, f'{FOLDER}{name}.md', _page(name, subject, described))
    _add(files, config, RETURNED, _page_of_returned(package, described))
    return files


def _pages(nav: object) -> Iterator[str]:
    """Yield the reference's pages that the navigation names, in its order."""
    if isinstance(nav, str):
        if nav.startswith(f'{FOLDER}{PACKAGE}'):
            yield nav
    elif isinstance(nav, (dict, list)):
        for part in nav.values() if isinstance(nav, dict) else nav:
            yield from _pages(part)


def _found(package: griffe.Object, name: str) -> griffe.Object:
    inside = name.split('.')[1:]
    return _target(package[inside]) if inside else package


def _target(found: griffe.Object | griffe.Alias) -> griffe.Object:
    return found.final_target if found.is_alias else found


def _add(files: Files, config: MkDocsConfig, path: str, content: str) -> None:
    files.append(File.generated(config, path, content=content))


def _page(name: str, subject: griffe.Object, described: dict[str, griffe.Object]) -> str:
    """Return a page, and add what it describes to what is described."""
    title = f'---\ntitle: {name}\n{_SEARCH}---\n\n'
    if not subject.is_module:
        return title + _directive(name, subject, heading_level=1)
    public = {f'{name}.{member}': _target(subject[member]) for member in _public(subject)}
    here = {full: found for full, found in public.items() if found.path not in described}
    described |= {found.path: found for found in here.values()}
    rows = [f'| [`{full.rpartition(".")[2]}`][{full}] | {_summary(found)} |'
            for full, found in public.items()]
    top = _directive(name, subject, heading_level=1, show_root_full_path=True, members=[])
    return '\n'.join([title + top, '| name | |', '| --- | --- |', *rows, '',
                      *(_directive(full, found) for full, found in here.items())])


def _directive(name: str, found: griffe.Object, **options: object) -> str:
    """Return what mkdocstrings replaces by a description; that of a record has all fields."""
    if found.is_class and {str(base) for base in found.bases} & _RECORDS:
        options['show_if_no_docstring'] = True
    return f'::: {name}\n    options: {json.dumps(options)}\n'


def _public(module: griffe.Object) -> list[str]:
    own = [name for name, member in module.members.items()
           if member.is_public and not member.is_alias and not member.is_module]
    return sorted(module.exports or own, key=str.lower)


def _summary(found: griffe.Object) -> str:
    text = found.docstring.value if found.docstring else ''
    return ' '.join(text.split('\n\n')[0].split()).replace('|', r'\|')


def _page_of_returned(package: griffe.Object, described: dict[str, griffe.Object]) -> str:
    named = {path for found in described.values() for path in _returned(found)}
    returned = {found.path for found in (_found(package, path) for path in named)
                if found.is_class}
    missing = (_found(package, path) for path in sorted(returned - described.keys()))
    return '\n'.join([f'---\n{_SEARCH}---\n\n# What they return', '',
                      *(_directive(found.path, found) for found in missing)])


def _returned(found: griffe.Object) -> Iterator[str]:
    """Yield what of the package a function returns, an attribute is, or a class's members do."""
    if found.is_class:
        for member in found.all_members.values():
            if member.is_public:
                yield from _returned(_target(member))
    told = getattr(found, 'returns' if found.is_function else 'annotation', None)
    for part in told.iterate() if isinstance(told, griffe.Expr) else ():
        if isinstance(part, griffe.ExprName) and part.canonical_path.startswith(f'{PACKAGE}.'):
            yield part.canonical_path
