# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The textbook's golden example and its exercise; ``docs/golden_example.md`` explains them."""

import contextlib
import io
import itertools
import math
from pathlib import Path
import re

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.core.geometry import se3

PAGE = Path(__file__).parents[2] / 'docs' / 'golden_example.md'

MAP_T_ODOM = Pose.from_xyz_rpy(x=2.0)
ODOM_T_BASE = Pose.from_xyz_rpy(0.5, 1.0)
ODOM_T_TURNED_BASE = Pose.from_xyz_rpy(0.5, 1.0, yaw=math.pi / 2)
BASE_T_CAMERA = Pose.from_xyz_rpy(0.2, 0.0, 0.8)
CAMERA_P = (1.0, 0.0, 0.0)


def robot(odom_T_base, static):
    buffer = BufferCore()
    for parent, child, pose in (('map', 'odom', MAP_T_ODOM), ('odom', 'base_link', odom_T_base),
                                ('base_link', 'camera', BASE_T_CAMERA)):
        for stamp in (10, 20):
            buffer.insert(parent, child, stamp, pose, static=static)
    return buffer


@pytest.fixture(params=[True, False], ids=['static', 'moving'])
def straight(request):
    return robot(ODOM_T_BASE, request.param)


@pytest.fixture(params=[True, False], ids=['static', 'moving'])
def turned(request):
    return robot(ODOM_T_TURNED_BASE, request.param)


def test_partial_products_are_the_origins_along_the_way(straight):
    origins = [straight.lookup('map', frame, 15).translation
               for frame in ('odom', 'base_link', 'camera')]
    assert np.array(origins) == pytest.approx(np.array(
        [(2.0, 0.0, 0.0), (2.5, 1.0, 0.0), (2.7, 1.0, 0.8)]))


def test_point_ahead_of_the_camera_is_on_the_map(straight):
    map_p = straight.lookup('map', 'camera', 15) @ CAMERA_P
    assert map_p == pytest.approx([3.7, 1.0, 0.8])


def test_turned_robot_moves_the_camera_and_turns_its_view(turned):
    map_T_camera = turned.lookup('map', 'camera', 15)
    assert map_T_camera.translation == pytest.approx((2.5, 1.2, 0.8))
    forward = map_T_camera @ CAMERA_P - np.array(map_T_camera.translation)
    assert forward == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    assert map_T_camera @ CAMERA_P == pytest.approx([2.5, 2.2, 0.8])


def test_there_and_back_is_the_identity(straight, turned):
    for buffer in (straight, turned):
        there, back = (buffer.lookup(*frames, 15)
                       for frames in itertools.permutations(('map', 'camera')))
        assert there @ back == pytest.approx(se3.IDENTITY, abs=1e-15)
        assert back @ there == pytest.approx(se3.IDENTITY, abs=1e-15)


def test_map_seen_from_the_turned_camera(turned):
    assert turned.lookup('camera', 'map', 15).translation == pytest.approx((-1.2, 2.5, -0.8))


def test_only_a_rotated_robot_shows_wrong_orders_and_inverses():
    right, wrong = (
        [compose(MAP_T_ODOM, odom_T_base, BASE_T_CAMERA).translation
         for odom_T_base in (ODOM_T_BASE, ODOM_T_TURNED_BASE)]
        for compose in (lambda a, b, c: a @ b @ c, lambda a, b, c: c @ b @ a))
    assert wrong[0] == pytest.approx(right[0])
    assert wrong[1] == pytest.approx((0.7, 3.0, 0.8))
    assert right[1] == pytest.approx((2.5, 1.2, 0.8))
    # Yaw applied to the edge's own translation too.
    spun = Pose.from_parts(rotation=ODOM_T_TURNED_BASE.rotation)
    twice = MAP_T_ODOM @ spun @ Pose(0.5, 1.0) @ BASE_T_CAMERA
    assert twice.translation == pytest.approx((1.0, 0.7, 0.8))


def blocks_of(language):
    return re.findall(rf'^```{language}\n(.*?)^```$', PAGE.read_text(), re.DOTALL | re.MULTILINE)


def test_program_on_the_page_prints_what_the_page_says():
    (program,), (*_, expected) = blocks_of('python'), blocks_of('text')
    assert len([line for line in program.splitlines() if line]) <= 15
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(program, str(PAGE), 'exec'), {})
    assert printed.getvalue() == expected


def test_numbers_of_the_page_are_those_of_this_test():
    text = PAGE.read_text()
    for numbers in ('(3.7, 1.0, 0.8)', '(2.5, 1.2, 0.8)', '(2.5, 2.2, 0.8)', '(0, 1, 0)',
                    '(2, 0, 0)', '(2.5, 1, 0)', '(2.7, 1, 0.8)', '(0.7, 3, 0.8)', '(1, 0.7, 0.8)',
                    '(-1.2, 2.5, -0.8)'):
        assert numbers in text
