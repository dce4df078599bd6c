# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The picture and the table of docs/design.md show the present layers and rooms."""

import importlib.util
import re

from code_blocks import REPOSITORY
import house
import pytest


@pytest.fixture(scope='module')
def figure():
    pytest.importorskip('matplotlib')
    spec = importlib.util.spec_from_file_location(
        'rooms', REPOSITORY / 'docs' / 'figures' / 'rooms.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_picture_shows_every_layer_and_room_with_its_caption(figure):
    drawn = re.findall('<!-- (.*?) -->', figure.PICTURE.read_text())
    assert drawn == [line for box in figure.boxes() for line in figure.lines_in(box)], (
        'python docs/figures/rooms.py draws it anew')
    rooms = [f'{layer}/{room}' for layer, of in house.LAYERS.items() for room in of.rooms.split()]
    assert sorted(box.place for box in figure.boxes()) == sorted([*house.LAYERS, *rooms])


def test_captions_fit_into_their_boxes(figure):
    for box in figure.boxes():
        assert len(figure.lines_in(box)) * figure.LINE + 2 * figure.MARGIN < box.height, box


def test_picture_fits_on_a_screen(figure):
    width, height = figure.picture().get_size_inches() * 96
    assert width <= 1000 and height <= 900


def test_layers_import_only_what_is_drawn_below_or_to_their_left(figure):
    order = ' '.join(reversed(figure.ROWS)).split()
    for layer, of in house.LAYERS.items():
        assert not set(of.imports.split()) - set(order[:order.index(layer)]), layer


def test_table_is_that_of_the_captions(figure):
    assert figure.BEGIN + figure.table() + figure.END in figure.DESIGN.read_text(), (
        'python docs/figures/rooms.py writes it anew')
