# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The framing of a page: it fits new frames and new sizes, until a person moves the camera."""

from types import SimpleNamespace

import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.view.model.moment import moment_at
from tf_tree_py.view.page.framing import CameraControl, Framing
from tf_tree_py.view.scene.scene import Appearance


class Browser:
    """A camera like viser's, whose reports a test sends."""

    def __init__(self):
        self.position, self.look_at = np.array((9.0, 9.0, 9.0)), np.zeros(3)
        self.fov, self.image_width, self.image_height = 1.3, 640, 480
        self._state = SimpleNamespace(update_timestamp=1.0)
        self.size = 640.0, 480.0

    def on_update(self, callback):
        pass

    def distance(self):
        return float(np.linalg.norm(self.position - self.look_at))


@pytest.fixture
def browser():
    return Browser()


@pytest.fixture
def framing(browser):
    camera = CameraControl(SimpleNamespace(camera=browser), lambda: browser.size, lambda: None)
    return Framing(camera, Appearance(), SimpleNamespace(set_sizes=lambda axes, cell: None))


@pytest.fixture(scope='module')
def moment():
    buffer = BufferCore(UNLIMITED)
    for number in range(8):
        buffer.insert('map', f'frame_{number}', 1, Pose(x=number / 4.0, y=number % 3 / 2.0),
                      static=True)
    return moment_at(buffer, 'map', 1)


def test_smaller_picture_is_fitted_despite_an_old_camera_report(
        browser, framing, moment):
    old = browser.position
    framing.see_new(moment, ())
    wide, fitted = browser.distance(), (browser.position, browser.look_at)
    browser.position = old  # the browser reported this before it received the fit
    browser.size = 200.0, 480.0
    framing.see_again()
    framing.see_new(moment, ())
    browser.position, browser.look_at = fitted
    framing.see_new(moment, ())
    assert browser.distance() > 1.5 * wide


def test_camera_that_a_person_moved_stays_in_a_window_of_another_size(browser, framing, moment):
    framing.see_new(moment, ())
    browser.position = moved = browser.position + 1.0
    browser.size = 200.0, 480.0
    framing.see_again()
    framing.see_new(moment, ())
    np.testing.assert_array_equal(browser.position, moved)
