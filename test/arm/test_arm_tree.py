# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The tree of the moving arm, compared with PyBullet's own poses of the links."""

from contextlib import closing

from examples.arm.cell import BEGIN, Cell, HAND, HAND_T_CAMERA, STEP
from examples.arm.pick_and_place import LOOKOUT
from examples.arm.scene import random_scene
from examples.arm.tree import ArmTree
import numpy as np
import pytest

SCENE = random_scene(np.random.default_rng(0))
GOAL = LOOKOUT + (0.3, 0.2, -0.2, 0.2, -0.3, 0.15, 0.3)
CLOSE = 1e-6
"""Metres, and of a unit quaternion; PyBullet computes in single precision."""


def recorded(cell, speed):
    """Move all joints; return world_T_link of every link after each step, by stamp."""
    poses = {}
    for _ in cell.moving_to(GOAL, speed):
        poses[cell.stamp] = cell.link_poses()
    return poses


def assert_agree(tree, poses):
    assert len(poses) > 100
    for stamp, world_T_links in poses.items():
        for name, pose in world_T_links.items():
            found = tree.lookup('world', name, stamp)
            same_sign = np.sign(np.dot(found.rotation, pose.rotation))
            assert found.translation == pytest.approx(pose.translation, abs=CLOSE), (stamp, name)
            assert same_sign * np.array(found.rotation) == pytest.approx(
                np.array(pose.rotation), abs=CLOSE), (stamp, name)


def test_tree_has_every_link_where_it_was_at_every_step():
    with closing(Cell(SCENE, LOOKOUT)) as cell:
        tree = ArmTree(cell)
        poses = recorded(cell, speed=0.8)
    # The lookups are made now, when the arm has moved on.
    assert len(poses[cell.stamp]) == 13
    assert_agree(tree, poses)


def test_camera_goes_where_the_hand_goes():
    with closing(Cell(SCENE, LOOKOUT)) as cell:
        tree = ArmTree(cell)
        poses = recorded(cell, speed=0.8)
    for stamp, world_T_links in poses.items():
        world_T_camera = world_T_links[HAND] @ HAND_T_CAMERA
        assert tree.lookup('world', 'camera', stamp).translation == pytest.approx(
            world_T_camera.translation, abs=CLOSE)


def test_half_way_between_steps_the_tree_is_right_too():
    """
    Compare interpolated poses with a second simulation of half the step.

    Where a joint accelerates by a, a straight line between two steps has an error of
    a T^2 / 8 rad; with steps of 2 ms and 1.2 rad/s^2 that is 0.6e-6.
    """
    step = STEP // 2
    with closing(Cell(SCENE, LOOKOUT, step)) as cell:
        tree = ArmTree(cell)
        recorded(cell, speed=0.3)
    with closing(Cell(SCENE, LOOKOUT, step // 2)) as finer:
        poses = recorded(finer, speed=0.3)
    between = {stamp: pose for stamp, pose in poses.items()
               if (stamp - BEGIN) % step and stamp < cell.stamp}
    assert_agree(tree, between)
