# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Real robots on a page in Chromium: no name covers another, and the controls cover no frame.

With ``--hypothesis-profile thorough``, names are compared at three zooms, otherwise at two.
"""

from contextlib import contextmanager
from pathlib import Path
import sysconfig
import time

from hypothesis import settings
import numpy as np
from open_page import OpenPage, overlaps
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.urdf import Robot
from tf_tree_py.view.robot.resting_robot import RestingRobot
from tf_tree_py.view.subject import Subject

pytest.importorskip('viser', reason='pages need viser')

FOLDER = Path(sysconfig.get_path('purelib'), 'cmeel.prefix/share/example-robot-data/robots')
DESCRIPTIONS = {
    'Panda': 'panda_description/urdf/panda.urdf',
    'PR2': 'pr2_description/urdf/pr2.urdf',
    'Talos': 'talos_data/robots/talos_reduced.urdf',
}
ZOOMS = 3 if settings().max_examples >= 200 else 2
FEWEST_NAMES = 5
WIDE, PHONE = {'width': 1000, 'height': 700}, {'width': 390, 'height': 800}

# The frames of a TurtleBot 4, metres: many sensors within 34 cm.
TURTLEBOT = {
    'base_footprint': ('odom', 0.0, 0.0, 0.0),
    'base_link': ('base_footprint', 0.0, 0.0, 0.006),
    'left_wheel': ('base_link', 0.0, 0.117, 0.036),
    'right_wheel': ('base_link', 0.0, -0.117, 0.036),
    'bump_front_center': ('base_link', 0.165, 0.0, 0.06),
    'bump_front_left': ('base_link', 0.137, 0.094, 0.06),
    'bump_front_right': ('base_link', 0.137, -0.094, 0.06),
    'bump_left': ('base_link', 0.06, 0.154, 0.06),
    'bump_right': ('base_link', 0.06, -0.154, 0.06),
    'cliff_front_left': ('base_link', 0.153, 0.04, 0.01),
    'cliff_front_right': ('base_link', 0.153, -0.04, 0.01),
    'cliff_side_left': ('base_link', 0.068, 0.139, 0.01),
    'cliff_side_right': ('base_link', 0.068, -0.139, 0.01),
    'ir_intensity_front_center_left': ('base_link', 0.162, 0.02, 0.05),
    'ir_intensity_front_center_right': ('base_link', 0.162, -0.02, 0.05),
    'ir_intensity_front_left': ('base_link', 0.15, 0.06, 0.05),
    'ir_intensity_front_right': ('base_link', 0.15, -0.06, 0.05),
    'ir_intensity_left': ('base_link', 0.12, 0.11, 0.05),
    'ir_intensity_right': ('base_link', 0.12, -0.11, 0.05),
    'ir_omni': ('base_link', 0.153, 0.0, 0.11),
    'button_power': ('base_link', 0.131, 0.0, 0.09),
    'mouse': ('base_link', 0.0, -0.08, 0.0),
    'imu_link': ('base_link', 0.05, 0.04, 0.02),
    'shell_link': ('base_link', 0.0, 0.0, 0.09),
    'rplidar_link': ('shell_link', -0.04, 0.0, 0.1),
    'oakd_camera_bracket': ('shell_link', -0.12, 0.0, 0.14),
    'oakd_link': ('oakd_camera_bracket', 0.06, 0.0, 0.03),
    'oakd_rgb_camera_frame': ('oakd_link', 0.0, 0.0, 0.0),
    'oakd_rgb_camera_optical_frame': ('oakd_rgb_camera_frame', 0.0, 0.0, 0.0),
    'oakd_left_camera_frame': ('oakd_link', 0.0, 0.0375, 0.0),
    'oakd_right_camera_frame': ('oakd_link', 0.0, -0.0375, 0.0),
}


def turtlebot():
    """Return a TurtleBot far from the origin of its map."""
    buffer = BufferCore(UNLIMITED)
    buffer.insert('map', 'odom', 1, Pose.from_xyz_rpy(x=3.0, y=1.0, yaw=0.4), static=True)
    for child, (parent, x, y, z) in TURTLEBOT.items():
        far = 9.0 if parent == 'odom' else 0.0
        buffer.insert(parent, child, 1, Pose(x=x + far, y=y, z=z), static=True)
    return Subject(buffer, False, time.time_ns, fixed_frame='map')


def subject_of(name):
    if name == 'TurtleBot':
        return turtlebot()
    if not FOLDER.is_dir():
        pytest.skip(f'{name} comes with example-robot-data: pip install example-robot-data')
    robot = Robot.load(FOLDER / DESCRIPTIONS[name])
    return Subject(BufferCore(), True, time.time_ns, resting=RestingRobot(robot))


@contextmanager
def opened(window, name, size):
    from tf_tree_py.view.serving import Serving
    with Serving(subject_of(name), '127.0.0.1', 18300, name) as serving:
        page = OpenPage(window, serving.url)
        page.page.set_viewport_size(size)
        yield page
        assert not page.complaints
        page.page.close()


def is_readable(page):
    """Return a predicate: the names of a page are inside its picture and do not overlap."""
    left, top, right, bottom = page.picture()

    def readable(names):
        return len(names) >= FEWEST_NAMES and not overlaps(names) and (
            (names[:, :2] >= -1.0).all()
            and (names[:, 2:] <= (right - left + 1.0, bottom - top + 1.0)).all())

    return readable


@pytest.mark.parametrize('size', [WIDE, PHONE], ids=['wide', 'phone'])
@pytest.mark.parametrize('name', ['TurtleBot', *DESCRIPTIONS])
def test_robot_is_seen_beside_the_controls_and_no_name_covers_another(window, name, size):
    outside = 2 if name == 'TurtleBot' else 0  # the origins of its map and its odometry
    with opened(window, name, size) as page:
        page.wait_for(page.names, len)

        def is_seen(pixels):
            left, top, right, bottom = page.picture()
            inside = ((pixels >= (left, top)) & (pixels <= (right, bottom))).all(axis=1)
            across = np.ptp(pixels[inside], axis=0) / (right - left, bottom - top)
            return (~inside).sum() == outside and across.max() > 0.4

        page.wait_for(page.pixels, is_seen)
        page.wait_for(lambda: [page.panel(), page.picture()],
                      lambda areas: not overlaps(areas))
        # Where there is room for many names.
        for _ in range(ZOOMS if size == WIDE else 0):
            page.wait_for(page.names, is_readable(page))
            left, top, right, bottom = page.picture()
            page.page.mouse.move((left + right) / 2.0, (top + bottom) / 2.0)
            page.page.mouse.wheel(0, -240)
