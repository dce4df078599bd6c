# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recorded scan and a camera on a page in Chromium: the positions of points, and the image."""

import io
import math

from bags import JAZZY, Message, write_ros2
import numpy as np
from open_page import OpenPage
import pytest
from tf_tree_py.bag import open_bag
from tf_tree_py.view.sensors.recorded_sensors import RecordedSensors
from tf_tree_py.view.subject import Subject

pytest.importorskip('viser', reason='pages need viser')
PIL_image = pytest.importorskip('PIL.Image', reason='compressed images need pillow')

SECOND = 1_000_000_000
BEGIN = 100 * SECOND
RANGES = np.linspace(1.0, 3.0, 40)
STAMPS_S = (0.2, 1.3, 2.0, 3.7, 4.4)


def base_at(time_s):
    """Return x, y and yaw of the base in the map: it drives along an arc."""
    return 0.4 * time_s, 0.1 * time_s ** 2, 0.9 * time_s


def expected_points(stamp):
    """Return the points of a scan in the map, computed explicitly for two planar frames."""
    x, y, yaw = base_at((stamp - BEGIN) / SECOND)
    points = []
    for number, distance in enumerate(RANGES):
        angle = -1.0 + 0.05 * number + math.pi / 2.0  # the laser is mounted with a yaw of 90 deg
        forward, left = 0.2 + distance * math.cos(angle), distance * math.sin(angle)
        points.append((x + forward * math.cos(yaw) - left * math.sin(yaw),
                       y + forward * math.sin(yaw) + left * math.cos(yaw), 0.3))
    return np.array(points)


def header(stamp, frame):
    types = JAZZY.types
    time = types['builtin_interfaces/msg/Time'](*divmod(stamp, SECOND))
    return types['std_msgs/msg/Header'](time, frame)


def message(stamp, topic, type_name, *fields):
    made = JAZZY.types[type_name](*fields)
    return Message(stamp, topic, [], type_name=type_name,
                   data=bytes(JAZZY.serialize_cdr(made, type_name)))


def scan(stamp):
    return message(stamp, '/scan', 'sensor_msgs/msg/LaserScan', header(stamp, 'laser'), -1.0,
                   0.95, 0.05, 0.0, 0.1, 0.1, 30.0, RANGES.astype(np.float32),
                   np.empty(0, np.float32))


def picture(stamp):
    data = io.BytesIO()
    PIL_image.fromarray(np.full((240, 320, 3), (200, 30, 40), np.uint8)).save(data, 'jpeg')
    return message(stamp, '/camera/compressed', 'sensor_msgs/msg/CompressedImage',
                   header(stamp, 'laser'), 'jpeg', np.frombuffer(data.getvalue(), np.uint8))


def transforms(stamp):
    x, y, yaw = base_at((stamp - BEGIN) / SECOND)
    pose = (x, y, 0.0, 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
    mount = (0.2, 0.0, 0.3, 0.0, 0.0, math.sin(math.pi / 4.0), math.cos(math.pi / 4.0))
    return Message(stamp, '/tf', [('map', 'base', stamp, pose), ('base', 'laser', stamp, mount)])


@pytest.fixture(scope='module')
def page(window, tmp_path_factory):
    from tf_tree_py.view.serving import Serving
    stamps = [BEGIN + number * SECOND // 10 for number in range(50)]
    bag = write_ros2(tmp_path_factory.mktemp('bags') / 'drive', [
        *map(transforms, stamps), *map(scan, stamps), *map(picture, stamps[::10])])
    subject = Subject(open_bag(bag), False, lambda: 0, sensors=RecordedSensors(bag))
    with Serving(subject, '127.0.0.1', 18250, 'test') as serving:
        page = OpenPage(window, serving.url)
        page.turn_to('sensors')
        yield page
        page.page.close()


def shows(expected):
    """Return a predicate: one of some clouds has the expected points."""
    return lambda clouds: any(
        len(cloud) == expected.size
        and np.allclose(np.reshape(cloud, (-1, 3)), expected, atol=1e-4) for cloud in clouds)


def test_points_of_a_scan_are_where_a_second_computation_puts_them(page):
    page.page.get_by_role('checkbox', name='/scan').check()
    for time_s in STAMPS_S:
        page.go_to(time_s)
        page.wait_for(lambda: page.scene()['points'], shows(expected_points(
            BEGIN + round(time_s * SECOND))))
    assert not page.complaints


def test_compressed_image_of_a_camera_is_shown(page):
    page.page.get_by_role('checkbox', name='/camera/compressed').check()
    page.go_to(2.05)
    shown = page.page.locator('img[src*="base64"], img[src^="blob:"]').first
    page.wait_for(lambda: shown.evaluate('image => [image.naturalWidth, image.naturalHeight]'),
                  lambda size: size == [320, 240])
    page.page.get_by_role('checkbox', name='/camera/compressed').uncheck()
    shown.wait_for(state='hidden')
    assert not page.complaints


def test_film_of_a_stretch_of_time_is_saved_as_a_gif(page):
    page.go_to(1.0)
    page.turn_to('look')
    page.field('length [s]').fill('0.3')
    page.page.keyboard.press('Enter')
    with page.page.expect_download() as download:
        page.press('record a GIF')
    with PIL_image.open(download.value.path()) as film:
        assert film.format == 'GIF' and film.n_frames == 4
        first = np.asarray(film.convert('RGB')).astype(int)
        film.seek(3)
        assert np.abs(np.asarray(film.convert('RGB')) - first).max() > 50
    page.wait_for_text('paused at 101.3')
    assert not page.complaints
