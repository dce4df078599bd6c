# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The picture of docs/design.md shows the current packages and imports."""

import importlib.util
import re

from pages import REPOSITORY
import pytest

DESIGN = (REPOSITORY / 'docs' / 'design.md').read_text()
PICTURE = (REPOSITORY / 'docs' / 'images' / 'rooms.svg').read_text()
LAYERS = ['core', 'bag', 'ros']


@pytest.fixture(scope='module')
def figure():
    pytest.importorskip('matplotlib')
    spec = importlib.util.spec_from_file_location(
        'rooms', REPOSITORY / 'docs' / 'figures' / 'rooms.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rooms_of(layer):
    return sorted(path.parent.name for path in (REPOSITORY / 'tf_tree_py' / layer).glob(
        '*/__init__.py'))


@pytest.mark.parametrize('layer', LAYERS)
def test_every_room_has_a_row_and_a_box(layer):
    missing = [room for room in rooms_of(layer)
               if f'\n| `{room}` |' not in DESIGN or f'<!-- {room} -->' not in PICTURE]
    assert not missing


@pytest.mark.parametrize('layer', LAYERS)
def test_arrows_are_the_imports_and_point_down(figure, layer):
    arrows = figure.arrows(layer)
    drawn = re.findall(rf'id="({layer}: [^"]+)"', PICTURE)
    assert sorted(drawn) == sorted(figure.name_of_arrow(layer, *arrow) for arrow in arrows), (
        'python docs/figures/rooms.py draws it anew')
    rooms = figure.LAYERS[layer][2]
    assert all(rooms[lower][1] < rooms[upper][1] for upper, lower in arrows)
