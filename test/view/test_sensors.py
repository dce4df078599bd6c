# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sensor messages become points, each transformed at the stamp at which it was measured."""

import io
from types import SimpleNamespace as Message

from bags import JAZZY, Message as BagMessage, write_ros2
import numpy as np
import pytest
from tf_tree_py import BufferCore
from tf_tree_py.bag import Connection
from tf_tree_py.bag.files import connections
from tf_tree_py.core import Pose, UNLIMITED
from tf_tree_py.view.model.moment import moment_at
from tf_tree_py.view.page.page import SensorView
from tf_tree_py.view.sensors.readings import is_known, MOST_POINTS, placed, Reading, reading_of
from tf_tree_py.view.sensors.recorded_sensors import decoded, RecordedSensors

PIL_image = pytest.importorskip('PIL.Image', reason='compressed images need pillow')

SECOND = 1_000_000_000


def header(stamp, frame='laser'):
    return Message(frame_id=frame, stamp=Message(sec=stamp // SECOND, nanosec=stamp % SECOND))


def turning(stamp):
    """Return the pose of the laser, which rotates by a radian a second and drives."""
    time_s = stamp / SECOND
    return Pose.from_xyz_rpy(x=time_s, y=0.1, z=0.3, yaw=time_s % 6.0)


@pytest.fixture
def tree():
    buffer = BufferCore(UNLIMITED)
    for stamp in range(SECOND, 5 * SECOND + 1, SECOND // 100):
        buffer.insert('map', 'laser', stamp, turning(stamp), strict=False)
    return buffer


def scan(stamp, time_increment=0.0):
    ranges = np.linspace(1.0, 2.0, 50, dtype=np.float32)
    ranges[[3, 7]] = np.inf, np.nan
    ranges[9] = 99.0
    return Message(header=header(stamp), ranges=ranges, range_min=0.1, range_max=30.0,
                   angle_min=-1.0, angle_increment=0.04, time_increment=time_increment)


@pytest.mark.parametrize('stamp', [
    SECOND, 15 * SECOND // 10, 2 * SECOND, 3_141_592_653, 4 * SECOND])
@pytest.mark.parametrize('time_increment', [0.0, 0.002])
def test_points_of_a_scan_stand_where_they_were_measured(tree, stamp, time_increment):
    reading = reading_of('sensor_msgs/msg/LaserScan', scan(stamp, time_increment))
    points = placed(tree, 'map', reading)
    expected = []
    for number, distance in enumerate(np.linspace(1.0, 2.0, 50, dtype=np.float32).tolist()):
        if number in (3, 7, 9):
            continue
        angle = -1.0 + 0.04 * number
        at = stamp + round(number * time_increment * SECOND)
        expected.append(tree.lookup('map', 'laser', at) @ (
            distance * np.cos(angle), distance * np.sin(angle), 0.0))
    np.testing.assert_allclose(points, expected, atol=1e-9)
    newest = placed(tree, 'map', reading, at_newest=True)
    assert np.linalg.norm(newest - points, axis=1).max() > 0.3


def cloud(stamp, count, **fields):
    datatypes = {'f4': 7, 'f8': 8, 'u4': 6}
    layout = np.dtype([(name, values.dtype.str[1:]) for name, values in fields.items()])
    data = np.zeros(count, layout)
    for name, values in fields.items():
        data[name] = values
    return Message(
        header=header(stamp), height=1, width=count, is_bigendian=False,
        point_step=layout.itemsize, row_step=layout.itemsize * count, data=data.tobytes(),
        fields=[Message(name=name, offset=layout.fields[name][1], count=1,
                        datatype=datatypes[layout.fields[name][0].str[1:]]) for name in fields])


def test_cloud_is_thinned_and_its_times_are_read(tree):
    count = 3 * MOST_POINTS
    x = np.arange(count, dtype=np.float32)
    x[0] = np.nan
    reading = reading_of('sensor_msgs/PointCloud2', cloud(
        2 * SECOND, count, x=x, y=x * 0.5, z=x * 0.0, t=np.arange(count, dtype=np.uint32) * 4000))
    assert 0.9 * MOST_POINTS < len(reading.points) <= MOST_POINTS
    np.testing.assert_allclose(reading.points[:, 1], reading.points[:, 0] / 2.0)
    np.testing.assert_array_equal(
        reading.stamps, 2 * SECOND + 4000 * reading.points[:, 0].astype(int))
    seconds = reading_of('sensor_msgs/PointCloud2', cloud(
        2 * SECOND, 2, x=x[1:3], y=x[1:3], z=x[1:3], time=np.array([0.0, 0.5], np.float32)))
    assert seconds.stamps.tolist() == [2 * SECOND, 5 * SECOND // 2]


@pytest.mark.parametrize(('times', 'stamps'), [
    ({}, None),
    ({'timestamp': np.array([1e18, 1e18 + 2**27])}, [0, 2**27]),  # Livox
    ({'timestamp': np.array([1e9, np.nan])}, [0]),
    ({'timestamp': np.array([500.0, 501.0])}, None),  # since the start of the sensor
])
def test_times_of_a_cloud_are_those_that_deskewing_uses(times, stamps):
    begin = 10**9 * SECOND
    x = np.zeros(2, np.float32)
    reading = reading_of('sensor_msgs/PointCloud2', cloud(begin, 2, x=x, y=x, z=x, **times))
    assert reading.problem == ''
    assert (None if reading.stamps is None else (reading.stamps - begin).tolist()) == stamps
    assert len(reading.points) == (2 if stamps is None else len(stamps))


def test_empty_cloud_has_no_points():
    nothing = np.zeros(0, np.float32)
    reading = reading_of('sensor_msgs/PointCloud2', cloud(
        SECOND, 0, x=nothing, y=nothing, z=nothing, time=nothing))
    assert (reading.problem, reading.points.shape) == ('', (0, 3))


def test_ways_and_poses_are_points(tree):
    def at(x):
        return Message(position=Message(x=x, y=0.0, z=0.0))

    poses = Message(header=header(SECOND), poses=[at(1.0), at(2.0)])
    assert reading_of('geometry_msgs/msg/PoseArray', poses).points.tolist() == [
        [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    way = Message(header=header(SECOND), poses=[Message(pose=at(1.0))])
    assert reading_of('nav_msgs/msg/Path', way).is_line
    odometry = Message(header=header(SECOND), pose=Message(pose=at(3.0)))
    assert reading_of('nav_msgs/msg/Odometry', odometry).points.tolist() == [[3.0, 0.0, 0.0]]
    assert not is_known('std_msgs/msg/String')
    assert reading_of('std_msgs/msg/String', Message(data='')) is None


def image(encoding, data, width=2, big=0, step=None):
    return Message(header=header(SECOND), encoding=encoding, height=1, width=width, data=data,
                   is_bigendian=big, step=len(data) if step is None else step)


@pytest.mark.parametrize(('message', 'pixels'), [
    (image('bgr8', bytes([1, 2, 3, 4, 5, 6, 0, 0])), [(3, 2, 1), (6, 5, 4)]),
    (image('rgba8', bytes([1, 2, 3, 0, 4, 5, 6, 0])), [(1, 2, 3), (4, 5, 6)]),
    (image('mono8', bytes([7, 200])), [(7, 7, 7), (200, 200, 200)]),
    (image('bayer_rggb8', bytes([7, 200])), [(7, 7, 7), (200, 200, 200)]),
    (image('16UC1', np.array([500, 1500], '<u2').tobytes()), [(0, 0, 0), (255, 255, 255)]),
    (image('mono16', np.array([1500, 500], '>u2').tobytes(), big=1), [(255,) * 3, (0,) * 3]),
    (image('32FC1', np.array([1, 3, np.nan, 2], '<f4').tobytes(), 4), [
        (0,) * 3, (255,) * 3, (0,) * 3, (127,) * 3]),
])
def test_raw_image_becomes_rgb_pixels(message, pixels):
    reading = reading_of('sensor_msgs/msg/Image', message)
    assert reading.problem == ''
    assert reading.image[0].tolist() == [list(pixel) for pixel in pixels]


def compressed(coding, pixels, size=None):
    data = io.BytesIO()
    PIL_image.fromarray(pixels).save(data, coding)
    return Message(header=header(SECOND), format=f'rgb8; {coding} compressed bgr8',
                   data=np.frombuffer(data.getvalue()[:size], np.uint8))


def test_compressed_image_becomes_rgb_pixels_of_the_size_that_a_page_needs():
    pixels = np.zeros((480, 640, 3), np.uint8)
    pixels[:, 320:] = 250, 120, 10
    for coding in ('jpeg', 'png'):
        shown = reading_of('sensor_msgs/msg/CompressedImage', compressed(coding, pixels)).image
        assert shown.shape == (240, 320, 3)
        np.testing.assert_allclose(shown[120, 80], (0, 0, 0), atol=6)
        np.testing.assert_allclose(shown[120, 240], (250, 120, 10), atol=6)
    depth = np.array([[1000, 3000]], np.uint16)
    assert reading_of('sensor_msgs/CompressedImage', compressed('png', depth)).image.tolist() == [
        [[0] * 3, [255] * 3]]


@pytest.mark.parametrize(('type_name', 'message', 'problem'), [
    ('Image', image('yuv422', bytes(4)), "'yuv422' are not supported"),
    ('Image', image('rgb8', bytes(5), step=6), '5 bytes, but 1 rows of 6'),
    ('CompressedImage', compressed('gif', np.zeros((2, 2), np.uint8)), 'cannot be read'),
    ('CompressedImage', compressed('png', np.zeros((99, 99), np.uint8), 60), 'cannot be read'),
    ('CompressedImage', Message(header=header(1), format='16UC1; compressedDepth png', data=b''),
     'compressed depth images are not supported'),
    ('PointCloud2', Message(header=header(1), height=1, width=1, is_bigendian=False, point_step=4,
                            row_step=4, data=bytes(4), fields=[]), 'x'),
])
def test_message_that_cannot_be_shown_says_why(tree, type_name, message, problem):
    reading = reading_of(f'sensor_msgs/msg/{type_name}', message)
    assert problem in reading.problem and not len(reading.points)
    sensors = Message(reading=lambda topic, stamp: reading)
    view = SensorView(sensors, Message(wanted=lambda: ['/camera'], at_newest=False,
                                       show_image=lambda pixels: None))
    assert view.seen(tree, moment_at(tree, 'map', 2 * SECOND)) == {}
    assert view.missing == [f'/camera: {reading.problem}']


def test_recorded_message_that_is_damaged_costs_only_itself(tmp_path):
    store = JAZZY.types
    stamp = store['builtin_interfaces/msg/Time'](5, 0)
    made = store['nav_msgs/msg/Path'](store['std_msgs/msg/Header'](stamp, 'map'), [])
    whole = bytes(JAZZY.serialize_cdr(made, 'nav_msgs/msg/Path'))
    bag = write_ros2(tmp_path / 'bag', [
        BagMessage(number, '/path', [], type_name='nav_msgs/msg/Path', data=data)
        for number, data in enumerate((whole, whole[:-4] + b'\xff' * 4, b'\x00\x01'))])
    sensors = RecordedSensors(bag)
    assert sensors.topics() == ['/path']
    sensors.want('/path', None)
    good, damaged = sensors.trail('/path', 6 * SECOND, 9)
    assert (good.frame, good.problem) == ('map', '')
    assert damaged.problem.startswith('the message cannot be decoded: ')


def test_recorded_detections_are_shown_though_rosbags_does_not_define_them(tmp_path):
    store = connections.typestore(False)
    types = store.types
    head = types['std_msgs/msg/Header'](types['builtin_interfaces/msg/Time'](5, 0), 'camera')
    pose = types['geometry_msgs/msg/Pose'](types['geometry_msgs/msg/Point'](1.0, 2.0, 3.0),
                                           types['geometry_msgs/msg/Quaternion'](0., 0., 0., 1.))
    box = types['vision_msgs/msg/BoundingBox3D'](
        pose, types['geometry_msgs/msg/Vector3'](1.0, 1.0, 1.0))
    type_name = 'vision_msgs/msg/Detection3DArray'
    made = types[type_name](head, [types['vision_msgs/msg/Detection3D'](head, [], box, '7')])
    data = bytes(store.serialize_cdr(made, type_name))
    connection = Connection('/detections', type_name, False, '')
    assert decoded(connection, data).points.tolist() == [[1.0, 2.0, 3.0]]


def test_reading_without_a_transform_has_no_place(tree):
    points = np.zeros((1, 3))
    assert placed(tree, 'map', Reading('camera', 2 * SECOND, points)) is None
    assert placed(tree, 'map', Reading('laser', 9 * SECOND, points)) is None
    late = Reading('laser', 5 * SECOND, np.zeros((2, 3)), np.array([5, 6]) * SECOND)
    assert len(placed(tree, 'map', late)) == 1
