# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Perception, on rendered images with known truth."""

from contextlib import closing

from examples.arm.furniture import furnish
from examples.arm.image import back_project, project
from examples.arm.perception import find_block, segment
from examples.arm.rendering import INTRINSICS, render
from examples.arm.scene import BLOCK_SIZE, random_scene, Scene
from examples.arm.simulator import Simulator
import numpy as np
import pytest
from tf_tree_py.core import Pose

VIEWS_OF_A_SCENE = 50
TOP = Pose(z=BLOCK_SIZE[2] / 2)


def looking(rng, at, distance, tilt):
    """Return world_T_camera at a distance and a tilt from straight down, randomly rotated."""
    bearing = rng.uniform(-np.pi, np.pi)
    ahead = -np.array([np.sin(tilt) * np.cos(bearing), np.sin(tilt) * np.sin(bearing),
                       np.cos(tilt)])
    right = np.cross(rng.normal(size=3), ahead)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(ahead, right), ahead, at - distance * ahead], axis=1)
    return Pose.from_matrix(matrix)


def random_view(rng, world_T_top):
    aside = (*rng.uniform(-0.05, 0.05, 2), 0.0)
    return looking(rng, np.add(world_T_top.translation, aside), rng.uniform(0.3, 0.6),
                   np.radians(rng.uniform(0.0, 35.0)))


def seen(scene, world_T_camera):
    with closing(Simulator()) as bullet:
        furnish(bullet, scene)
        return render(bullet, world_T_camera, INTRINSICS, 0)


@pytest.fixture(scope='module')
def errors():
    """Return true_T_found of the block's top in 200 random views."""
    rng = np.random.default_rng(7)
    found_errors = []
    for _ in range(200 // VIEWS_OF_A_SCENE):
        scene = random_scene(rng)
        world_T_top = scene.block @ TOP
        with closing(Simulator()) as bullet:
            furnish(bullet, scene)
            for _ in range(VIEWS_OF_A_SCENE):
                world_T_camera = random_view(rng, world_T_top)
                found = find_block(render(bullet, world_T_camera, INTRINSICS, 0))
                assert found is not None
                found_errors.append(world_T_top.inverse() @ world_T_camera @ found)
    assert len(found_errors) == 200
    return found_errors


def test_top_is_found_to_three_millimetres_in_200_views(errors):
    distances = np.linalg.norm([error.translation for error in errors], axis=1)
    assert distances.max() < 0.003
    assert np.median(distances) < 0.0003


def test_camera_is_calibrated(errors):
    """An image centre that is wrong by half a pixel would cause an error of 1 mm."""
    assert abs(np.mean([error.translation for error in errors], axis=0)).max() < 0.0001


def test_top_is_turned_as_the_block_is(errors):
    roll, pitch, yaw = np.degrees([error.as_rpy() for error in errors]).T
    assert max(abs(roll).max(), abs(pitch).max()) < 1.0
    # A block looks the same after half a turn.
    assert abs((yaw + 90.0) % 180.0 - 90.0).max() < 4.0


ABOVE = Pose.from_xyz_rpy(x=0.5, z=0.5, roll=np.pi)
MIDDLE = Pose(x=0.5, z=BLOCK_SIZE[2] / 2)
# The distance from the middle of the image to its border, at the height of a block's top.
EDGE = (ABOVE.z - BLOCK_SIZE[2]) * INTRINSICS.width / 2 / INTRINSICS.focal


@pytest.mark.parametrize('block', [
    MIDDLE._replace(x=1.5),
    MIDDLE._replace(x=0.5 + EDGE),
    MIDDLE._replace(x=0.5 + EDGE - BLOCK_SIZE[0] / 2 + 0.003),
], ids=['out of sight', 'cut in half by the border', 'cut a little'])
def test_block_that_is_not_wholly_seen_is_not_found(block):
    assert find_block(seen(Scene(block, [MIDDLE, MIDDLE._replace(y=0.15)]), ABOVE)) is None


def test_block_that_is_half_covered_is_not_found():
    cover = MIDDLE._replace(x=0.52, z=0.1)
    assert find_block(seen(Scene(MIDDLE, [cover]), ABOVE)) is None


def test_only_the_red_block_is_red():
    scene = Scene(MIDDLE, [MIDDLE._replace(y=0.1), MIDDLE._replace(y=-0.1)])
    rows, columns = np.nonzero(segment(seen(scene, ABOVE).color))
    x, y = INTRINSICS.center
    assert abs(rows - y).max() < 20 and abs(columns - x).max() < 20
    assert len(rows) > 200


def test_projection_is_the_inverse_of_back_projection():
    points = back_project(seen(Scene(MIDDLE, []), ABOVE))
    pixels = project(points.reshape(-1, 3), INTRINSICS).reshape(*points.shape[:2], 2)
    assert pixels[17, 250] == pytest.approx((250.0, 17.0))
