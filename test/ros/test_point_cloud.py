# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""PointCloud2 transformed without conversion, in any layout; a LaserScan becomes one."""

from copy import deepcopy
import math
import sys

from geometry_msgs.msg import TransformStamped
from inputs import for_each
import message_tools as tools
from message_tools import make_cloud, stamped_transform
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py.beyond.motion.scans import field_column, points_of, write_points
from tf_tree_py.core import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.ros.messages import point_cloud
from tf_tree_py.ros.messages.do_transform import do_transform_laser_scan
from tf_tree_py.ros.messages.point_cloud import (
    as_cloud,
    do_transform_cloud,
    packed_cloud,
    points_of_scan,
)

INF, NAN = math.inf, math.nan
POSE = (1.0, -2.0, 3.0, 0.5, -0.5, 0.5, -0.5)
TURN = stamped_transform((0.0, 0.0, 0.0, 0.0, 0.0, 2 ** -0.5, 2 ** -0.5))


def column(cloud, name):
    """Read a field byte by byte, with another method than the code's."""
    field = next(field for field in cloud.fields if field.name == name)
    code = next(code for code, datatype in tools.DATATYPES.items() if datatype == field.datatype)
    dtype = np.dtype(('>' if cloud.is_bigendian else '<') + code)
    data = bytes(cloud.data)
    begins = [row * cloud.row_step + place * cloud.point_step + field.offset
              for row in range(cloud.height) for place in range(cloud.width)]
    return np.array([np.frombuffer(data[begin:begin + dtype.itemsize], dtype)[0]
                     for begin in begins], dtype=dtype.newbyteorder('='))


def coordinates(cloud, names=('x', 'y', 'z')):
    return np.stack([column(cloud, name) for name in names], axis=1)


def random_columns(rng, count, dtype, names=('x', 'y', 'z')):
    return {name: rng.normal(size=count).astype(dtype) * 10 for name in names}


XYZ_F4 = {'x': 0, 'y': 4, 'z': 8}
LAYOUTS = {
    'packed': (XYZ_F4, 12, {}),
    'padded points': (XYZ_F4, 32, {}),
    'unaligned': ({'x': 1, 'y': 6, 'z': 11}, 17, {}),
    'another order': ({'z': 0, 'x': 8, 'y': 20}, 24, {}),
    'organised': (XYZ_F4, 16, {'height': 6}),
    'padded rows': (XYZ_F4, 16, {'height': 6, 'row_padding': 24}),
    'longer than it says': (XYZ_F4, 16, {'tail': 100}),
}


def a_point(dtype='f8'):
    """Return a dense cloud of the point (1, 1, 1)."""
    columns = {name: np.ones(1, dtype) for name in 'xyz'}
    return packed_cloud(Header(frame_id='lidar'), columns, True)


# --- transforming


@for_each(layout=LAYOUTS, dtype=['f4', 'f8', 'mixed'], big=[False, True])
def test_points_move_and_nothing_else_does(layout, dtype, big):
    offsets, point_step, options = LAYOUTS[layout]
    rng = np.random.default_rng(1)
    columns = random_columns(rng, 60, 'f4' if dtype == 'mixed' else dtype)
    if dtype != 'f4':
        offsets = {name: 2 * offset for name, offset in offsets.items()}
        point_step *= 2
        columns['y'] = columns['y'].astype('f8')
    columns['ring'] = rng.integers(0, 1000, 60).astype('u2')
    offsets = {**offsets, 'ring': point_step}
    cloud = make_cloud(columns, offsets, point_step + 2, big=big, **options)
    transform = stamped_transform(POSE)
    moved = do_transform_cloud(cloud, transform)

    given = np.stack([columns[name] for name in 'xyz'], axis=1)
    assert points_of(cloud).dtype == given.dtype
    assert points_of(cloud).dtype.isnative
    assert points_of(cloud).tolist() == given.tolist()
    expected = se3.apply_many(POSE, given)
    assert coordinates(moved) == pytest.approx(expected, rel=2e-7 if dtype != 'f8' else 1e-14)
    arrived = deserialize_message(serialize_message(cloud), PointCloud2)
    assert do_transform_cloud(arrived, transform) == moved
    assert deserialize_message(serialize_message(moved), PointCloud2) == moved
    assert moved.header == transform.header
    # With the old coordinates put back, every byte is as before.
    back = deepcopy(moved)
    back.header = cloud.header
    write_points(back, points_of(cloud))
    assert back == cloud


@for_each(count=[1, point_cloud.BLOCK - 1, point_cloud.BLOCK, point_cloud.BLOCK + 1,
                 3 * point_cloud.BLOCK + 5])
def test_every_point_of_every_block_moves_and_is_rounded_once(count):
    columns = random_columns(np.random.default_rng(2), count, 'f4')
    moved = do_transform_cloud(packed_cloud(Header(), columns, True), stamped_transform(POSE))
    expected = se3.apply_many(POSE, np.stack(list(columns.values()), axis=1))
    assert points_of(moved) == pytest.approx(expected, rel=1e-6)
    assert (points_of(moved) == expected.astype(np.float32)).mean() > 0.999


def test_result_shares_nothing():
    cloud = make_cloud(random_columns(np.random.default_rng(4), 10, 'f4'), XYZ_F4, 12)
    moved = do_transform_cloud(cloud, stamped_transform(POSE))
    # The memory is not referenced either: an array with a view cannot grow.
    moved.data.append(1)
    cloud.data.append(1)
    tools.assert_shares_nothing(do_transform_cloud, cloud, stamped_transform(POSE))


def test_transform_may_be_bare_and_its_quaternion_of_any_length():
    longer = stamped_transform((0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 5.0))
    for transform, point in ((TURN, (-1.0, 1.0, 1.0)), (longer, (-1.0, 1.0, 1.0)),
                             (TransformStamped(), (1.0, 1.0, 1.0))):
        moved = do_transform_cloud(a_point(), transform.transform)
        assert moved.header == a_point().header
        assert points_of(moved)[0] == pytest.approx(point)
        moved.header = transform.header
        assert moved == do_transform_cloud(a_point(), transform)


@for_each(data=[bytes, bytearray, memoryview, np.array])
def test_data_may_be_anything_with_bytes(data):
    other = a_point('f4')
    other._data = data(other.data)
    assert do_transform_cloud(other, TURN) == do_transform_cloud(a_point('f4'), TURN)
    assert points_of(other).tolist() == [[1.0, 1.0, 1.0]]


# --- invalid points


@pytest.mark.filterwarnings('error')
def test_holes_stay_and_what_a_float_cannot_hold_becomes_infinite():
    values = np.ones((5, 3), dtype='f4')
    values[1], values[2, 1], values[3] = math.nan, math.nan, math.inf
    cloud = packed_cloud(Header(), dict(zip('xyz', values.T, strict=True)), False)
    moved = do_transform_cloud(cloud, stamped_transform(POSE))
    assert np.isnan(points_of(moved)[1:4]).all()
    assert np.isfinite(points_of(moved)[[0, 4]]).all()
    far_away = stamped_transform((1e39, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    moved = do_transform_cloud(a_point('f4'), far_away)
    assert points_of(moved)[0].tolist() == [math.inf, 1.0, 1.0]
    assert moved.is_dense


@for_each(cloud=[
    PointCloud2(), PointCloud2(height=1), PointCloud2(height=1, point_step=12),
    packed_cloud(Header(), {name: np.ones(0) for name in 'xyz'}, True),
    PointCloud2(height=0, width=10, point_step=12),
])
def test_empty_clouds_only_change_their_header(cloud):
    moved = do_transform_cloud(cloud, TURN, rotate_normals=True)
    assert moved.header == TURN.header
    moved.header = cloud.header
    assert moved == cloud
    assert points_of(cloud).shape == (0, 3)


# --- normals


def test_normals_are_turned_and_missed_only_when_asked():
    names = ('x', 'y', 'z', 'normal_x', 'normal_y', 'normal_z')
    columns = random_columns(np.random.default_rng(6), 30, 'f4', names)
    cloud, transform = packed_cloud(Header(), columns, True), stamped_transform(POSE)
    before = coordinates(cloud, names[3:])
    kept = do_transform_cloud(cloud, transform)
    turned = do_transform_cloud(cloud, transform, rotate_normals=True)
    assert (coordinates(kept, names[3:]) == before).all()
    assert coordinates(turned, names[3:]) == pytest.approx(
        se3.apply_many((0.0, 0.0, 0.0, *POSE[3:]), before), rel=1e-6)
    assert (coordinates(turned) == coordinates(kept)).all()
    with pytest.raises(InvalidArgumentException, match="no field 'normal_x'; its fields are: x"):
        do_transform_cloud(a_point(), TURN, rotate_normals=True)


# --- invalid clouds


def some_cloud(field=None, **changes):
    """Return a cloud of six points; changes are those of a field, or of the cloud."""
    columns = random_columns(np.random.default_rng(7), 6, 'f4', ('x', 'y', 'z', 'i'))
    cloud = packed_cloud(Header(), columns, True)
    for name, value in changes.items():
        setattr(cloud if field is None else cloud.fields[field], name, value)
    return cloud


ODD = r"'x' of the cloud has the datatype \d and the count"
INTEGERS = r"The field 'z' of the cloud holds u?int\d+; only FLOAT32 and FLOAT64"
SHORT = r'The cloud declares \d+ x \d+ points of \d+ bytes, in rows of'


@pytest.mark.parametrize(('field', 'changes', 'sentence'), [
    (None, {'fields': []}, "no field 'x'; its fields are: none at all"),
    (1, {'name': 'Y'}, "no field 'y'; its fields are: x, Y, z, i"),
    (2, {'datatype': PointField.INT32}, INTEGERS),
    (2, {'datatype': PointField.UINT8}, INTEGERS),
    (0, {'datatype': 0}, ODD),
    (0, {'datatype': 9}, ODD),
    (0, {'count': 3}, ODD),
    (0, {'offset': 13}, "'x' of the cloud begins at byte 13 and does not fit into a point of 16"),
    (None, {'width': 7}, SHORT),
    (None, {'height': 2}, SHORT),
    (None, {'height': 2, 'row_step': 1}, SHORT),
    (None, {'width': 3, 'height': 2, 'row_step': 40}, SHORT),
    (None, {'width': 2, 'height': 3, 'row_step': 0}, SHORT),
    (None, {'width': 2**31, 'point_step': 2**31}, SHORT),
])
def test_invalid_cloud_is_refused_in_a_sentence(field, changes, sentence):
    for function in (points_of, lambda cloud: do_transform_cloud(cloud, TURN)):
        with pytest.raises(InvalidArgumentException, match=sentence):
            function(some_cloud(field, **changes))


@for_each(change=[(0, {'count': 0}), (None, {'row_step': 0}), (None, {'row_step': 7}),
                  (None, {'row_step': 10**6})])
def test_count_of_zero_is_one_and_a_single_row_needs_no_row_step(change):
    field, changes = change
    cloud = some_cloud(field, **changes)
    moved = do_transform_cloud(cloud, TURN)
    assert points_of(moved).tolist() == points_of(do_transform_cloud(some_cloud(), TURN)).tolist()
    assert moved.row_step == cloud.row_step


@pytest.mark.parametrize(('row_padding', 'shape'), [(0, (1, 6)), (4, (3, 2))])
def test_rows_without_padding_are_one_and_the_last_needs_none(row_padding, shape):
    cloud = make_cloud(random_columns(np.random.default_rng(11), 6, 'f4'), XYZ_F4, 12, height=3,
                       row_padding=row_padding)
    assert field_column(cloud, 'x').shape == shape
    expected = points_of(cloud).tolist()
    cloud.data = cloud.data[:len(cloud.data) - row_padding]
    assert points_of(cloud).tolist() == expected


# --- points, reading, creating


def test_points_without_a_message_are_moved_alike():
    by_hand = stamped_transform((10.0, 20.0, 30.0, 1.0, 0.0, 0.0, 0.0))
    for transform in (by_hand, by_hand.transform):
        moved = point_cloud.transform_points([(1, 2, 3)], transform)
        assert moved.tolist() == [[11.0, 18.0, 27.0]]
    for dtype, count in (('f4', 1), ('f8', 0)):
        moved = point_cloud.transform_points(np.zeros((count, 3), dtype), TURN)
        assert (moved.dtype, moved.shape) == (float, (count, 3))


def test_packed_cloud_says_where_everything_is():
    columns = {'x': np.arange(3, dtype='f4'), 't': np.arange(3, dtype='u4') + 7,
               'far': np.arange(3, dtype='f8')}
    cloud = packed_cloud(Header(frame_id='lidar'), columns, True)
    assert [(field.name, field.offset, field.datatype, field.count) for field in cloud.fields] == [
        ('x', 0, 7, 1), ('t', 4, 6, 1), ('far', 8, 8, 1)]
    assert (cloud.height, cloud.width, cloud.point_step, cloud.row_step) == (1, 3, 16, 48)
    assert cloud.is_bigendian is (sys.byteorder == 'big')
    for name, values in columns.items():
        assert column(cloud, name).tolist() == values.tolist()


# --- laser scans


def scan_of(ranges, **fields):
    return LaserScan(**{
        'header': Header(frame_id='laser'), 'angle_min': -math.pi / 2,
        'angle_increment': math.pi / 4, 'range_min': 0.5, 'range_max': 10.0,
        'ranges': ranges, **fields})


def test_rays_point_where_their_angles_say():
    cloud = as_cloud(scan_of([1.0, 2.0, 3.0, 4.0, 5.0]))
    angles = np.linspace(-math.pi / 2, math.pi / 2, 5)
    expected = np.arange(1.0, 6.0) * [np.cos(angles), np.sin(angles), np.zeros(5)]
    assert points_of(cloud) == pytest.approx(expected.T, rel=3e-7, abs=1e-6)
    assert cloud.header.frame_id == 'laser'
    assert [field.name for field in cloud.fields] == ['x', 'y', 'z']
    assert {field.datatype for field in cloud.fields} == {PointField.FLOAT32}
    assert cloud.is_dense


@pytest.mark.filterwarnings('error')
# 0.1 and 3.3 have no exact float32: the stored values are slightly greater or smaller.
@for_each(example=[
    ([INF, -INF, NAN, 0.0, 0.49, 0.5, 10.0, 10.01, -1.0], {}, [0.5, 10.0]),
    ([0.1, 3.3], {'range_min': 0.1, 'range_max': 3.3}, [0.1, 3.3]),
    ([1.0, INF], {'range_max': INF}, [1.0]),
    # Fields may hold ints.
    ([1, 2], {'range_max': 20, 'angle_increment': 1}, [1.0, 2.0]),
    ([1, 2], {'time_increment': 1, 'range_min': 0}, [1.0, 2.0]),
    ([], {}, []),
    ([INF, NAN], {}, []),
])
def test_only_rays_that_hit_something_are_points(example):
    ranges, limits, expected = example
    scan = scan_of(ranges, **limits)
    cloud = as_cloud(scan)
    assert (cloud.height, cloud.width) == (1, len(expected))
    for points in (points_of(cloud), points_of_scan(scan)):
        assert points.shape == (len(expected), 3)
        assert np.linalg.norm(points, axis=1) == pytest.approx(expected, rel=1e-6)


@pytest.mark.filterwarnings('error')
def test_intensities_and_times_stay_with_their_rays():
    scan = scan_of([1.0, INF, 2.0, NAN], intensities=[7.0, 8.0, 9.0, 6.0], time_increment=0.25)
    cloud = as_cloud(scan)
    assert column(cloud, 'intensity').tolist() == [7.0, 9.0]
    assert column(cloud, 'time').tolist() == [0.0, 0.5]
    without = as_cloud(scan_of([1.0, 2.0], intensities=[7.0]))
    assert [field.name for field in without.fields] == ['x', 'y', 'z']

    with_holes = as_cloud(scan, True)
    assert np.isnan(points_of(with_holes)).all(axis=1).tolist() == [False, True, False, True]
    assert column(with_holes, 'intensity').tolist() == [7.0, 8.0, 9.0, 6.0]
    assert not with_holes.is_dense
    assert as_cloud(scan_of([1.0, 2.0]), True).is_dense


def test_scan_is_moved_and_not_changed():
    scan = scan_of([1.0, INF, 2.0], intensities=[1.0, 2.0, 3.0])
    expected = do_transform_cloud(as_cloud(scan), TURN)
    tools.assert_shares_nothing(do_transform_laser_scan, scan, TURN)
    assert do_transform_laser_scan(scan, TURN) == expected
