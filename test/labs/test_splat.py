# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pictures of splats: rendered correctly, and localised."""

from lab_reports import report_of, rows_of
import numpy as np
import pytest
from tf_tree_py.core import se3
from tf_tree_py.labs.splat import driven, HEIGHT, moved, picture, room, Scene, WIDTH


def one_by_one(scene, map_T_camera):
    """Composite back to front, one Gaussian after the other: the other order, the same sum."""
    camera_T_map = np.linalg.inv(se3.as_matrix(map_T_camera))
    image = np.full((HEIGHT, WIDTH, 3), 0.4)
    places = scene.means @ camera_T_map[:3, :3].T + camera_T_map[:3, 3]
    v, u = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    for index in np.argsort(-places[:, 2]):
        x, y, z = places[index]
        if z <= 0.3:
            continue
        jacobian = 36.0 * np.array([[1 / z, 0, -x / z**2], [0, 1 / z, -y / z**2]])
        affine = jacobian @ camera_T_map[:3, :3]
        spread = affine @ scene.covariances[index] @ affine.T + 0.3 * np.eye(2)
        d = np.stack([u - WIDTH / 2 - 36.0 * x / z, v - HEIGHT / 2 - 36.0 * y / z], axis=-1)
        density = np.exp(-0.5 * np.einsum('...i,ij,...j', d, np.linalg.inv(spread), d))
        alpha = np.minimum(scene.opacities[index] * density, 0.99)[..., None]
        image = alpha * scene.colours[index] + (1.0 - alpha) * image
    return image


def test_picture_is_that_of_one_gaussian_after_the_other():
    pose = moved(driven(0), np.array([0.2, 0.1, -0.1, 0.3, -0.2, 0.5]))
    np.testing.assert_allclose(picture(room(), pose), one_by_one(room(), pose), atol=1e-12)


def test_nearer_one_hides_what_is_behind():
    def blob(distance, colour):
        return [distance, driven(0)[1], 0.0], 0.2 * np.eye(3), colour, 1.0

    scene = Scene(*map(np.array, zip(blob(4.0, [0, 1, 0]), blob(2.0, [1, 0, 0]), strict=True)))
    red, green, _ = picture(scene, driven(0))[HEIGHT // 2, WIDTH // 2]
    assert red > 0.95 and green < 0.05


def test_camera_is_found_from_five_centimetres_and_three_degrees():
    for row in rows_of('splat'):
        assert row['off_m'] == pytest.approx(0.05)
        assert row['off_rad'] == pytest.approx(np.radians(3.0))
        assert row['found_m'] < 0.01 and row['found_rad'] < np.radians(0.5)
        assert row['found_m'] < 4.0 * row['sigma_m']


def test_anchor_that_it_feeds_keeps_the_camera_in_place():
    numbers = report_of('splat').numbers
    assert numbers['anchored_m'] < 0.03 < numbers['odometry_m']
