# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A robot without transforms has the pose of its joint sliders."""

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose
from tf_tree_py.urdf import Robot
from tf_tree_py.view.panels.appearance_panel import JointsPanel
from tf_tree_py.view.robot.resting_robot import RestingRobot
from tf_tree_py.view.subject import Subject

ARM = """<robot name="arm"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
  <limit lower="0.1" upper="0.5"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
  <limit lower="x" upper="1"/><mimic joint="j" multiplier="2"/></joint></robot>"""


def test_joints_move_it_and_what_mimics_them_follows():
    robot = RestingRobot(Robot.parse(ARM))
    slider, = robot.sliders
    # The rest position is within the range of the slider, whatever the limits are.
    assert slider == ('j', 0.0, 0.5, 0.0)
    assert robot.buffer.lookup('a', 'c') == Pose()
    robot.move('j', 0.3)
    np.testing.assert_allclose(robot.buffer.lookup('a', 'c')[:3], (0.9, 0.0, 0.0))


class Gui:
    """The controls of a page, without a browser."""

    def __init__(self):
        self.folder = nullcontext()
        self.slider = None

    def add_folder(self, name, expand_by_default):
        return self.folder

    def add_button(self, label):
        return SimpleNamespace(on_click=lambda action: None)

    def add_slider(self, name, initial_value, **_):
        self.slider = SimpleNamespace(value=initial_value, on_update=self._keep)
        return self.slider

    def _keep(self, changed):
        self.changed = changed


def test_entered_position_is_not_overwritten_before_its_event():
    robot, gui = RestingRobot(Robot.parse(ARM)), Gui()
    panel = JointsPanel(gui, robot, lambda action: action())
    robot.move('j', 0.2)
    panel.refresh(visible=True)
    assert gui.slider.value == 0.2
    gui.slider.value = 0.4
    panel.refresh(visible=True)
    assert gui.slider.value == 0.4
    gui.changed(SimpleNamespace(client='a browser'))
    assert robot.positions == {'j': 0.4}
    robot.move('j', 0.1)
    panel.refresh(visible=True)
    assert gui.slider.value == 0.1


def test_it_is_seen_until_transforms_come():
    buffer, robot = BufferCore(), RestingRobot(Robot.parse(ARM))
    subject = Subject(buffer, True, lambda: 0, resting=robot)
    assert subject.rests and subject.tree is robot.buffer
    buffer.insert('map', 'odom', 1, Pose())
    assert not subject.rests and subject.tree is buffer


@pytest.mark.parametrize(('lower', 'upper', 'limits'), [
    ('-1', '2', (-1.0, 2.0)), ('2', '-1', None), ('x', '1', None)])
def test_limits_that_cannot_be_read_are_none(lower, upper, limits):
    text = ARM.replace('lower="0.1" upper="0.5"', f'lower="{lower}" upper="{upper}"')
    assert Robot.parse(text).moving[0].limits == limits
