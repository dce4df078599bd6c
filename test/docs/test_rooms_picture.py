# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The picture of docs/design.md shows the rooms and imports that there are."""

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
