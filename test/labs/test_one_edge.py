# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""One changed line changes the lookups over its edge, and no others."""

from lab_reports import report_of, rows_of
import pytest
from tf_tree_py.core.geometry import se3
from tf_tree_py.labs.one_edge import description, EDIT, edited, edits, SHOWN
from tf_tree_py.labs.remount import humanoid
from tf_tree_py.urdf import Robot


def test_description_is_the_humanoid_a_line_for_each_fact():
    robot = Robot.parse(description())
    edges = robot.edges()
    assert len(robot.joints) == 38 and len(robot.links) == 39
    assert len(description().splitlines()) == 38 + 39 + 2
    for edge, pose in edges.items():
        distance, angle = se3.distance(humanoid().lookup(*edge), tuple(pose))
        assert distance < 1e-15 and angle < 1e-7


def test_an_edit_is_one_line():
    text = description()
    new, number = edited(text, 'torso')
    differing = [line for line, (old, edited_line) in enumerate(
        zip(text.splitlines(), new.splitlines(), strict=True), start=1) if old != edited_line]
    assert differing == [number]
    old, now = (next(joint.origin for joint in Robot.parse(each).joints if joint.name == 'torso')
                for each in (text, new))
    assert old.inverse() @ now == pytest.approx(EDIT, abs=1e-15)


def test_every_line_changes_only_lookups_over_its_edge():
    for edit in edits():
        assert edit.changed == edit.crossing == 2 * edit.below * (39 - edit.below)
        assert edit.others == 0 and edit.off < 1e-14


def test_report_says_so():
    numbers = report_of('one-edge').numbers
    assert (numbers['frames'], numbers['edges'], numbers['lookups']) == (39, 38, 1482)
    assert numbers['as_predicted'] is True
    assert (numbers['least_changed'], numbers['most_changed']) == (76, 748)
    assert [row['child'] for row in rows_of('one-edge')] == list(SHOWN)
