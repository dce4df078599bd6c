# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""456 places compared with one edge."""

from math import dist, radians

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.core import Pose
from tf_tree_py.labs.remount import humanoid, MODULES, REMOUNT, SENSORS


def test_humanoid_has_38_edges():
    edges = humanoid().edges()
    assert len(edges) == 38
    fixed = {edge.child for edge in edges if edge.static}
    assert len([frame for frame in fixed if frame.endswith('camera')]) == 4
    assert fixed >= {'lidar', 'imu'} and len(fixed) == 6
    moving = {(edge.parent, edge.child) for edge in edges if not edge.static}
    assert len(moving - {('map', 'odom'), ('odom', 'pelvis')}) == 30


def test_every_frame_hangs_on_the_map():
    assert len(humanoid().lookup_tree('map')) == 39


def test_places_of_the_text():
    numbers = report_of('remount').numbers
    assert (numbers['modules'], numbers['places'], numbers['tree_changed']) == (12, 456, 1)
    assert numbers['places_changed'] == 12
    assert (numbers['places_used'], numbers['places_used_changed']) == (71, 5)


def test_forgotten_module_is_wrong_by_the_lever_of_what_it_looks_at():
    offset = SENSORS['head', 'head_camera'].inverse() @ REMOUNT
    assert offset.translation == pytest.approx((0.02, 0.0, 0.03))
    for module, row in zip(MODULES, rows_of('remount', 1), strict=True):
        sensed = (module.ahead, 0.0, 0.0)
        uses = module.sensor == 'head_camera'
        assert row['uses_it'] == uses
        moved = dist(offset @ sensed, Pose() @ sensed) if uses else 0.0
        assert row['moved_m'] == pytest.approx(moved, abs=1e-12)
        assert row['turned_rad'] == pytest.approx(radians(5.0) if uses else 0.0, abs=1e-7)
