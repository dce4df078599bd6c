# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The framing on the screen: the camera shows all points, and no name covers another."""

from itertools import combinations

from effort import examples
from hypothesis import given, strategies as st
import numpy as np
import pytest
from tf_tree_py.view.framing.camera import (
    Camera,
    cell_of,
    layout,
    lengths_on_screen,
    of_the_robot,
    rectangle,
    size_of,
)

SIZES = [(955.0, 800.0), (390.0, 400.0), (200.0, 900.0)]


def camera_of(size, position=(3.0, -3.0, 2.0), look_at=(0.0, 0.0, 0.0)):
    return Camera(np.array(position), np.array(look_at), np.radians(75.0), *size)


coordinates = st.floats(-50.0, 50.0, allow_subnormal=False)
clouds = st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=1, max_size=20)


@pytest.mark.parametrize('size', SIZES)
@given(clouds)
@examples(2)
def test_fitted_camera_sees_all_points_and_fills_the_picture(size, cloud):
    points = np.array(cloud)
    fitted = camera_of(size).fitted(points, 0.1)
    pixels, depths = fitted.project(points)
    assert (depths > 0.0).all()
    assert (pixels >= 0.0).all() and (pixels <= size).all()
    *across, along = np.ptp(fitted.axes() @ points.T, axis=1)
    # Points behind each other cover little of the picture, at any distance of the camera.
    if max(across) > max(1.0, 2.0 * along):
        assert (np.ptp(pixels, axis=0) / size).max() > 0.3


def test_projection_is_the_pinhole_camera():
    camera = camera_of((200.0, 100.0), (0.0, -10.0, 0.0))
    pixels, depths = camera.project(np.array([(0, 0, 0), (1, 0, 0), (0, 0, 1)], float))
    pixel = 1.0 / float(camera.metres_per_pixel(10.0))
    np.testing.assert_allclose(pixels, [(100, 50), (100 + pixel, 50), (100, 50 - pixel)])
    np.testing.assert_allclose(depths, 10.0)
    assert pixel == pytest.approx(50.0 / np.tan(np.radians(37.5)) / 10.0)


names = st.text('abcil_W/', min_size=1, max_size=30)


@pytest.mark.parametrize('size', SIZES)
@given(st.lists(st.tuples(names, coordinates, coordinates, coordinates), max_size=60), st.data())
@examples(2)
def test_no_name_covers_another_and_the_first_are_there(size, frames, data):
    texts = [name for name, *_ in frames]
    positions = np.array([position for _, *position in frames]).reshape(-1, 3) / 10.0
    camera = camera_of(size, (9.0, -9.0, 6.0))
    found = layout(camera, texts, positions, [], {}, 100)
    assert_free(camera, texts, positions, found)
    # The shown names keep their places if nothing moves.
    assert layout(camera, texts, positions, [], found, 100).items() >= found.items()
    if frames:
        first = data.draw(st.integers(0, len(frames) - 1))
        chosen = layout(camera, texts, positions, [first], found, 100)
        pixels, depths = camera.project(positions)
        wide, high = size_of(texts[first])
        inside = ((pixels[first] > (wide, high)) & (pixels[first] < size - np.array((wide, high))))
        assert first in chosen or depths[first] <= 0.0 or not inside.all()


def assert_free(camera, texts, positions, found):
    pixels, _ = camera.project(positions)
    taken = [rectangle(pixels[place], size_of(texts[place]), side)
             for place, side in found.items()]
    for one, other in combinations(taken, 2):
        assert not one.meets(other)
    for each in taken:
        assert each.left >= 0.0 and each.right <= camera.width
        assert each.top >= 0.0 and each.bottom <= camera.height


def test_map_far_away_is_not_of_the_robot():
    robot = np.random.default_rng(3).uniform(-0.3, 0.3, (30, 3)) + (12.0, 5.0, 0.0)
    inside = of_the_robot(np.vstack([[(0.0, 0.0, 0.0)], robot]))
    assert not inside[0] and inside[1:].all()
    assert of_the_robot(np.zeros((1, 3))).all()


def test_axes_are_neither_lost_nor_in_the_way():
    camera = camera_of((800.0, 600.0), (0.0, -10.0, 0.0))
    near_and_far = np.array([(0.0, -9.0, 0.0), (0.0, 0.0, 0.0), (0.0, 900.0, 0.0)])
    lengths = lengths_on_screen(camera, near_and_far, 0.6)
    pixels = lengths / camera.metres_per_pixel(camera.project(near_and_far)[1])
    np.testing.assert_allclose(pixels[[0, 2]], (42.0, 14.0))
    assert lengths[1] == 0.6
    assert (lengths_on_screen(None, near_and_far, 0.6) == 0.6).all()


@pytest.mark.parametrize(('reach', 'cell'), [(0.6, 0.1), (1.0, 0.2), (3.0, 0.5), (40.0, 10.0)])
def test_cells_of_the_ground_are_round(reach, cell):
    assert cell_of(reach) == pytest.approx(cell)
