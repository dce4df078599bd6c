# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The table of layers and rooms, what lives in each, and what the files in them import.

python docs/figures/house.py counts the files, the lines and the uses of ``Any`` of each layer.

``test/house/test_walls.py`` holds the code to the table, and ``rooms.py`` draws it.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
import re
from typing import NamedTuple

PACKAGE = Path(__file__).parents[2] / 'tf_tree_py'


class Layer(NamedTuple):
    """A folder of the package, or a file of its top level."""

    imports: str
    """The layers that its files may import, besides their own."""
    rooms: str = ''
    """Its rooms, each of which may import those before it."""
    needs: str | None = None
    """The packages that it may import; None for a layer that may import ROS."""


LAYERS = {
    'interfaces': Layer('', needs='numpy rosidl_adapter rosidl_generator_c rosidl_generator_py '
                        'rosidl_generator_type_description rosidl_typesupport_c '
                        'rosidl_typesupport_fastrtps_c rosidl_typesupport_introspection_c'),
    'command': Layer('core', needs='rich'),
    'core': Layer('', 'geometry edges messages tree buffer', needs='numpy scipy'),
    'files': Layer('core', needs='numpy'),
    'screws': Layer('core', needs='numpy'),
    'many_stamps': Layer('core', needs='numpy'),
    'outline': Layer('core', needs=''),
    'beyond': Layer('core files screws many_stamps',
                    'framed uncertainty curves motion corrections prediction sources freshness',
                    needs='numpy scipy'),
    'recording': Layer('core files', needs='rosbags'),
    'reports': Layer('core files beyond', needs='numpy'),
    'buffer_core': Layer('core files outline many_stamps beyond recording reports', needs=''),
    'frame_names': Layer('core', needs=''),
    'limited_log': Layer('core', needs=''),
    'thinning': Layer('core', needs='numpy'),
    'health': Layer('core', 'measures checks', needs='numpy'),
    'urdf': Layer('core buffer_core', needs='numpy xacro'),
    'bag': Layer('core frame_names beyond recording buffer_core health urdf', 'files assembly',
                 needs='apsw backports compression lz4 numpy rich rosbags ruamel'),
    'shared': Layer('core files buffer_core', needs='numpy'),
    'calibration': Layer('core screws beyond buffer_core bag', needs='numpy rosbags scipy'),
    'fleet': Layer('core limited_log beyond buffer_core', needs='numpy zenoh'),
    'ros': Layer('core screws frame_names limited_log beyond recording buffer_core reports health '
                 'thinning shared',
                 'messages threads waiting buffer topics remote filtering'),
    'nodes': Layer('command core frame_names limited_log beyond buffer_core reports health '
                   'thinning bag urdf shared fleet ros'),
    'tools': Layer('command core files outline limited_log beyond recording buffer_core reports '
                   'health thinning calibration bag urdf shared fleet ros',
                   'export archive calibrate'),
    'view': Layer('command core limited_log beyond buffer_core reports health bag urdf fleet ros '
                  'tools',
                  'model robot sensors framing scene panels page'),
    'labs': Layer('command core files screws beyond buffer_core reports health calibration bag '
                  'urdf ros', 'live'),
    'dropin': Layer('core screws many_stamps beyond buffer_core reports health bag ros'),
}


class Caption(NamedTuple):
    """What lives in a layer or a room: the docstring of its ``__init__``, or of its file."""

    summary: str
    details: str


def caption(place: str) -> Caption:
    """Return what lives in ``core``, ``core/tree``; a paragraph that leads to code is left out."""
    text = ast.get_docstring(ast.parse(modules()[tuple(place.split('/'))].read_text())) or ''
    summary, *details = (' '.join(part.split()) for part in text.split('\n\n')[:2])
    return Caption(summary, ' '.join(part for part in details if part.endswith('.')))


class Import(NamedTuple):
    """One name that a file imports."""

    level: int
    """How many dots it begins with; 0 is an absolute import."""
    module: str
    """The module and the name, with a dot between."""


@cache
def files() -> list[Path]:
    """Return the files of all layers; ``dropin/packages`` is written like a user's code."""
    return sorted(path for path in PACKAGE.rglob('*.py') if path != PACKAGE / '__init__.py'
                  and not {'__pycache__', 'packages'} & set(path.parts))


class Size(NamedTuple):
    """The lines of a file: code without blank lines, comments and docstrings; imports; all."""

    code: int
    imports: int
    lines: int


def size_of(path: Path) -> Size:
    """Count the lines of a file."""
    text = path.read_text()
    lines = text.splitlines()
    left_out = {number for number, line in enumerate(lines, 1)
                if not line.strip() or line.strip().startswith('#')}
    imports: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            if ast.get_docstring(node, clean=False) is not None:
                left_out.update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            imports.update(range(node.lineno, node.end_lineno + 1))
    code = set(range(1, len(lines) + 1)) - left_out
    return Size(len(code), len(code & imports), len(lines))


def anys_of(path: Path) -> int:
    """Count the uses of ``Any`` as a type, also in annotations that are texts; no imports."""
    nodes = [*ast.walk(ast.parse(path.read_text()))]
    texts = [each.value for node in nodes for field in ('annotation', 'returns')
             if isinstance(part := getattr(node, field, None), ast.AST) for each in ast.walk(part)
             if isinstance(each, ast.Constant) and isinstance(each.value, str)]
    return (sum(isinstance(node, ast.Name) and node.id == 'Any' for node in nodes)
            + sum(len(re.findall(r'\bAny\b', text)) for text in texts))


def parts(path: Path) -> tuple[str, ...]:
    """Return a file's place in the package; an ``__init__`` has that of its folder."""
    *folders, name = path.relative_to(PACKAGE).with_suffix('').parts
    return tuple(folders) if name == '__init__' else (*folders, name)


@cache
def imports_of(path: Path) -> list[Import]:
    """Return every import in a file, also those inside functions."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [Import(0, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [Import(node.level, '.'.join(filter(None, (node.module, alias.name))))
                      for alias in node.names]
    return found


@cache
def modules() -> dict[tuple[str, ...], Path]:
    """Return all files, each by its place."""
    return {parts(path): path for path in files()}


def imported(path: Path) -> Iterator[tuple[str, ...]]:
    """Yield the place of each module of the package that a file imports."""
    folder = path.relative_to(PACKAGE).parts[:-1]
    for level, module in imports_of(path):
        place = tuple(module.split('.'))
        if level:
            place = folder[:len(folder) - level + 1] + place
        elif place[0] == 'tf_tree_py':
            place = place[1:]
        else:
            continue
        while place and place not in modules():
            place = place[:-1]
        if place:
            yield place


def room_of(place: tuple[str, ...]) -> str:
    """Return the room of a module, ``core/tree``; for a file in no room, the file."""
    return '/'.join(place[:2])


def graph_of_files(layer: str) -> dict[str, set[str]]:
    """Return which file of a layer imports which."""
    return {'/'.join(place): {'/'.join(other) for other in imported(path)
                              if other[0] == layer and other != place}
            for place, path in modules().items() if place[0] == layer}


def graph_of_rooms(layer: str) -> dict[str, set[str]]:
    """Return which room of a layer imports which; a file in no room counts as one."""
    graph: dict[str, set[str]] = {}
    for place, path in modules().items():
        # The layer's own __init__ collects names from everywhere in it.
        if place[0] == layer and len(place) > 1:
            room = room_of(place)
            graph.setdefault(room, set()).update(
                other for far in imported(path) if far[0] == layer and len(far) > 1
                for other in [room_of(far)] if other != room)
    return graph


def print_sizes() -> None:
    """Print how many files, lines and uses of ``Any`` each layer has, and its longest file."""
    print(f'{"":14}{"files":>6}{"code":>8}{"imports":>9}{"longest":>9}{"Any":>6}')
    for layer in [*LAYERS, '']:
        paths = [path for path in files() if layer in ('', parts(path)[0])]
        sizes = [size_of(path) for path in paths]
        print(f'{layer or "all":14}{len(sizes):6}{sum(size.code for size in sizes):8}'
              f'{sum(size.imports for size in sizes):9}{max(size.lines for size in sizes):9}'
              f'{sum(map(anys_of, paths)):6}')


if __name__ == '__main__':
    print_sizes()
