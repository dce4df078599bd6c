# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The motion of the robot of five frames, independent of its publisher."""

import math

from inputs import for_each
import pytest
from tf_tree_py.core.stamp import from_seconds
from tf_tree_py.nodes.five_frame_motion import FiveFrameMotion

NOW = from_seconds(1_732_000_000.0)
STEP = from_seconds(1e-3)
STAMPS = [NOW + from_seconds(0.77) * i for i in range(30)]
MOTION = FiveFrameMotion(radius=3.0, lap_time=from_seconds(10.0))


@for_each(stamp=STAMPS)
def test_robot_drives_a_circle_and_looks_where_it_goes(stamp):
    here, there = MOTION.odom_T_base_link(stamp - STEP), MOTION.odom_T_base_link(stamp + STEP)
    at = MOTION.odom_T_base_link(stamp)
    assert math.hypot(at.x, at.y) == pytest.approx(3.0)
    way = [there.x - here.x, there.y - here.y, there.z - here.z]
    ahead = at @ (1.0, 0.0, 0.0) - at.translation
    assert ahead == pytest.approx([step / math.hypot(*way) for step in way], abs=1e-6)


@for_each(stamp=STAMPS)
def test_motion_repeats_exactly(stamp):
    assert MOTION.odom_T_base_link(stamp) == MOTION.odom_T_base_link(stamp + MOTION.lap_time)


def test_camera_looks_forward_and_a_little_down():
    x, y, z = MOTION.base_link_T_camera @ (1.0, 0.0, 0.0) - MOTION.base_link_T_camera.translation
    assert x > 0.9
    assert y == 0.0
    assert z < -0.1


def test_arm_reaches_out_and_turns():
    poses = [MOTION.base_link_T_gripper(stamp) for stamp in STAMPS]
    assert max(pose.x for pose in poses) - min(pose.x for pose in poses) > 0.3
    assert max(pose.as_rpy()[1] for pose in poses) > 0.8
    assert min(pose.as_rpy()[2] for pose in poses) < -0.2


def test_drift_is_slow_and_is_there():
    drift = [MOTION.world_T_odom(stamp) for stamp in STAMPS]
    assert drift[0] != drift[1]
    for a, b in zip(drift, drift[1:], strict=False):
        assert math.hypot(*(a.inverse() @ b).translation) < 0.03


@for_each(stamp=STAMPS)
def test_gripper_in_the_world_is_the_product_of_matrices(stamp):
    product = (MOTION.world_T_odom(stamp).as_matrix() @ MOTION.odom_T_base_link(stamp).as_matrix()
               @ MOTION.base_link_T_gripper(stamp).as_matrix())
    assert MOTION.world_T_gripper(stamp).as_matrix() == pytest.approx(product, abs=1e-12)
