# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""PointCloud2 transformed without conversion, in any layout."""

from array import array
from copy import deepcopy
import math
import sys

from geometry_msgs.msg import TransformStamped
from hypothesis import given, strategies as st
from inputs import for_each
from message_tools import inverse_of, mutable_parts, poses, spoil, stamped_transform
import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py.core import InvalidArgumentException
from tf_tree_py.core.geometry import se3
from tf_tree_py.ros.messages import point_cloud
from tf_tree_py.ros.messages.point_cloud import (
    do_transform_cloud,
    packed_cloud,
    points_of,
    transform_points,
    write_points,
)

POSE = (1.0, -2.0, 3.0, 0.5, -0.5, 0.5, -0.5)
TURN = stamped_transform((0.0, 0.0, 0.0, 0.0, 0.0, 2 ** -0.5, 2 ** -0.5))
DATATYPES = {'f4': PointField.FLOAT32, 'f8': PointField.FLOAT64, 'u1': PointField.UINT8,
             'u2': PointField.UINT16, 'i4': PointField.INT32, 'u4': PointField.UINT32}


def make_cloud(columns, offsets, point_step, height=1, row_padding=0, big=False, tail=0, seed=0):
    """
    Return a cloud whose gaps are filled with noise.

    :param columns: {name: (N,) array}, whose types are those of the fields.
    """
    count = len(next(iter(columns.values())))
    width = count // height
    row_step = width * point_step + row_padding
    noise = np.random.default_rng(seed).integers(0, 256, height * row_step + tail)
    data = array('B', noise.astype(np.uint8).tobytes())
    fields = []
    for name, values in columns.items():
        kind = np.dtype(values.dtype).newbyteorder('>' if big else '<')
        view = np.ndarray((height, width), kind, data, offsets[name], (row_step, point_step))
        view[:] = values.reshape(height, width)
        fields.append(PointField(name=name, offset=offsets[name], count=1,
                                 datatype=DATATYPES[values.dtype.str[1:]]))
    return PointCloud2(header=Header(frame_id='lidar'), height=height, width=width, fields=fields,
                       is_bigendian=big, point_step=point_step, row_step=row_step, data=data,
                       is_dense=False)


def column(cloud, name):
    """Read a field byte by byte, with another method than the code's."""
    field = next(field for field in cloud.fields if field.name == name)
    code = next(code for code, datatype in DATATYPES.items() if datatype == field.datatype)
    kind = np.dtype(('>' if cloud.is_bigendian else '<') + code)
    data = bytes(cloud.data)
    begins = [row * cloud.row_step + place * cloud.point_step + field.offset
              for row in range(cloud.height) for place in range(cloud.width)]
    return np.array([np.frombuffer(data[begin:begin + kind.itemsize], kind)[0]
                     for begin in begins], dtype=kind.newbyteorder('='))


def coordinates(cloud, names=('x', 'y', 'z')):
    return np.stack([column(cloud, name) for name in names], axis=1)


def random_columns(rng, count, kind, names=('x', 'y', 'z')):
    return {name: rng.normal(size=count).astype(kind) * 10 for name in names}


LAYOUTS = {
    'packed': ({'x': 0, 'y': 4, 'z': 8}, 12, {}),
    'padded points': ({'x': 0, 'y': 4, 'z': 8}, 32, {}),
    'unaligned': ({'x': 1, 'y': 6, 'z': 11}, 17, {}),
    'another order': ({'z': 0, 'x': 8, 'y': 20}, 24, {}),
    'organised': ({'x': 0, 'y': 4, 'z': 8}, 16, {'height': 6}),
    'padded rows': ({'x': 0, 'y': 4, 'z': 8}, 16, {'height': 6, 'row_padding': 24}),
    'longer than it says': ({'x': 0, 'y': 4, 'z': 8}, 16, {'tail': 100}),
}


# --- transforming


@for_each(layout=LAYOUTS, kind=['f4', 'f8', 'mixed'], big=[False, True])
def test_points_move_and_nothing_else_does(layout, kind, big):
    offsets, point_step, options = LAYOUTS[layout]
    rng = np.random.default_rng(1)
    columns = random_columns(rng, 60, 'f4' if kind == 'mixed' else kind)
    if kind != 'f4':
        offsets = {name: 2 * offset for name, offset in offsets.items()}
        point_step *= 2
        columns['y'] = columns['y'].astype('f8')
    columns['ring'] = rng.integers(0, 1000, 60).astype('u2')
    offsets = {**offsets, 'ring': point_step}
    cloud = make_cloud(columns, offsets, point_step + 2, big=big, **options)
    before = deepcopy(cloud)
    transform = stamped_transform(POSE)
    moved = do_transform_cloud(cloud, transform)

    expected = se3.apply_many(POSE, np.stack([columns[name] for name in 'xyz'], axis=1))
    assert coordinates(moved) == pytest.approx(expected, rel=2e-7 if kind != 'f8' else 1e-14)
    assert cloud == before
    assert moved.header == transform.header
    for field in ('height', 'width', 'fields', 'is_bigendian', 'point_step', 'row_step',
                  'is_dense'):
        assert getattr(moved, field) == getattr(cloud, field)
    # With the old coordinates put back, every byte is as before.
    back = deepcopy(moved)
    write_points(back, points_of(cloud))
    assert back.data == cloud.data
    assert (column(moved, 'ring') == columns['ring']).all()


@pytest.mark.parametrize('count', [1, point_cloud._BLOCK - 1, point_cloud._BLOCK,
                                   point_cloud._BLOCK + 1, 3 * point_cloud._BLOCK + 5])
def test_every_point_of_every_block_moves(count):
    columns = random_columns(np.random.default_rng(2), count, 'f4')
    moved = do_transform_cloud(packed_cloud(Header(), columns, True), stamped_transform(POSE))
    expected = se3.apply_many(POSE, np.stack(list(columns.values()), axis=1))
    assert points_of(moved) == pytest.approx(expected, rel=1e-6, abs=1e-5)


def test_single_precision_is_rounded_once():
    columns = random_columns(np.random.default_rng(3), 5000, 'f4')
    moved = points_of(do_transform_cloud(packed_cloud(Header(), columns, True),
                                         stamped_transform(POSE)))
    exact = se3.apply_many(POSE, np.stack(list(columns.values()), axis=1))
    assert (moved == exact.astype(np.float32)).mean() > 0.999


@given(poses, st.integers(0, 2**32 - 1), st.booleans())
def test_there_and_back_again(pose, seed, big):
    columns = random_columns(np.random.default_rng(seed), 20, 'f8')
    cloud = make_cloud(columns, {'x': 0, 'y': 8, 'z': 16}, 24, big=big)
    transform = stamped_transform(pose)
    back = do_transform_cloud(do_transform_cloud(cloud, transform),
                              inverse_of(transform, se3.inverse(pose)))
    assert points_of(back) == pytest.approx(points_of(cloud), abs=1e-10)


def test_result_shares_nothing():
    cloud = make_cloud(random_columns(np.random.default_rng(4), 10, 'f4'),
                       {'x': 0, 'y': 4, 'z': 8}, 12)
    transform = stamped_transform(POSE)
    before, transform_before = deepcopy(cloud), deepcopy(transform)
    moved = do_transform_cloud(cloud, transform)
    mine = {id(part) for part in mutable_parts(moved)}
    assert not mine & {id(part) for part in (*mutable_parts(cloud), *mutable_parts(transform))}
    moved_before = deepcopy(moved)
    spoil(cloud)
    spoil(transform)
    assert moved == moved_before
    spoil(moved)
    assert do_transform_cloud(before, transform_before) == moved_before
    # The memory is not referenced either: an array with a view cannot grow.
    moved_before.data.append(1)
    before.data.append(1)


def test_cloud_survives_the_wire():
    cloud = make_cloud(random_columns(np.random.default_rng(5), 12, 'f4'),
                       {'x': 0, 'y': 4, 'z': 8}, 20, height=3, row_padding=4)
    arrived = deserialize_message(serialize_message(cloud), PointCloud2)
    moved = do_transform_cloud(arrived, stamped_transform(POSE))
    assert moved == do_transform_cloud(cloud, stamped_transform(POSE))
    assert deserialize_message(serialize_message(moved), PointCloud2) == moved


def test_bare_transform_leaves_the_header():
    cloud = packed_cloud(Header(frame_id='lidar'), {name: np.ones(1) for name in 'xyz'}, True)
    moved = do_transform_cloud(cloud, TURN.transform)
    assert moved.header == cloud.header
    assert points_of(moved)[0] == pytest.approx((-1.0, 1.0, 1.0))


@pytest.mark.parametrize('data', [bytes, bytearray, memoryview, lambda data: np.array(data)])
def test_data_may_be_anything_with_bytes(data):
    cloud = packed_cloud(Header(), {name: np.ones(2, dtype='f4') for name in 'xyz'}, True)
    other = deepcopy(cloud)
    other._data = data(cloud.data)
    moved = do_transform_cloud(other, TURN)
    assert moved == do_transform_cloud(cloud, TURN)
    assert points_of(other).tolist() == [[1.0, 1.0, 1.0]] * 2


def test_quaternion_need_not_be_of_unit_length():
    cloud = packed_cloud(Header(), {name: np.ones(1) for name in 'xyz'}, True)
    longer = stamped_transform((0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 5.0))
    assert points_of(do_transform_cloud(cloud, longer))[0] == pytest.approx((-1.0, 1.0, 1.0))
    assert points_of(do_transform_cloud(cloud, TransformStamped()))[0].tolist() == [1.0] * 3


# --- invalid points


@pytest.mark.filterwarnings('error')
def test_holes_stay_where_they_are():
    values = np.ones((5, 3), dtype='f4')
    values[1] = math.nan
    values[2, 1] = math.nan
    values[3] = math.inf
    cloud = packed_cloud(Header(), dict(zip('xyz', values.T, strict=True)), False)
    moved = points_of(do_transform_cloud(cloud, stamped_transform(POSE)))
    assert np.isnan(moved[1:4]).all()
    assert np.isfinite(moved[[0, 4]]).all()


@pytest.mark.filterwarnings('error')
def test_what_a_float_cannot_hold_becomes_infinite():
    cloud = packed_cloud(Header(), {name: np.array([1.0], dtype='f4') for name in 'xyz'}, True)
    moved = do_transform_cloud(cloud, stamped_transform((1e39, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)))
    assert points_of(moved)[0].tolist() == [math.inf, 1.0, 1.0]


@pytest.mark.parametrize('is_dense', [True, False])
def test_is_dense_is_kept(is_dense):
    cloud = packed_cloud(Header(), {name: np.ones(1) for name in 'xyz'}, is_dense)
    assert do_transform_cloud(cloud, TURN).is_dense is is_dense


@pytest.mark.parametrize('cloud', [
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


def test_normals_are_turned_only_when_asked():
    names = ('x', 'y', 'z', 'normal_x', 'normal_y', 'normal_z')
    columns = random_columns(np.random.default_rng(6), 30, 'f4', names)
    cloud = packed_cloud(Header(), columns, True)
    transform = stamped_transform(POSE)
    before = coordinates(cloud, names[3:])
    assert (coordinates(do_transform_cloud(cloud, transform), names[3:]) == before).all()
    turned = do_transform_cloud(cloud, transform, rotate_normals=True)
    assert coordinates(turned, names[3:]) == pytest.approx(
        se3.apply_many((0.0, 0.0, 0.0, *POSE[3:]), before), rel=1e-6, abs=1e-6)
    assert (coordinates(turned) == coordinates(do_transform_cloud(cloud, transform))).all()


def test_missing_normals_are_missed_only_when_asked():
    cloud = packed_cloud(Header(), {name: np.ones(1) for name in 'xyz'}, True)
    with pytest.raises(InvalidArgumentException, match="no field 'normal_x'; its fields are: x"):
        do_transform_cloud(cloud, TURN, rotate_normals=True)


# --- invalid clouds


def with_field(cloud, number, **changes):
    for name, value in changes.items():
        setattr(cloud.fields[number], name, value)
    return cloud


@pytest.fixture
def cloud():
    columns = random_columns(np.random.default_rng(7), 6, 'f4', ('x', 'y', 'z', 'i'))
    return packed_cloud(Header(), columns, True)


def refused(cloud, match):
    with pytest.raises(InvalidArgumentException, match=match):
        do_transform_cloud(cloud, TURN)
    with pytest.raises(InvalidArgumentException, match=match):
        points_of(cloud)


def test_missing_coordinate_is_named(cloud):
    refused(with_field(cloud, 1, name='Y'), "no field 'y'; its fields are: x, Y, z, i")
    cloud.fields = []
    refused(cloud, "no field 'x'; its fields are: none at all")


@pytest.mark.parametrize('datatype', [PointField.INT32, PointField.UINT8, PointField.INT16])
def test_coordinates_of_integers_are_refused(cloud, datatype):
    refused(with_field(cloud, 2, datatype=datatype),
            r"The field 'z' of the cloud holds u?int\d+; only FLOAT32 and FLOAT64")


@pytest.mark.parametrize('changes', [{'datatype': 0}, {'datatype': 9}, {'count': 3}])
def test_odd_fields_are_refused(cloud, changes):
    refused(with_field(cloud, 0, **changes), r"'x' of the cloud has the datatype \d and the count")


def test_a_count_of_zero_is_one(cloud):
    before = points_of(cloud).copy()
    assert (points_of(with_field(cloud, 0, count=0)) == before).all()


def test_a_field_that_sticks_out_is_refused(cloud):
    refused(with_field(cloud, 0, offset=13), "'x' of the cloud begins at byte 13 and does not fit "
                                             'into a point of 16 bytes')


@pytest.mark.parametrize('changes', [{'width': 7}, {'height': 2}, {'height': 2, 'row_step': 1},
                                     {'width': 3, 'height': 2, 'row_step': 40},
                                     {'width': 2, 'height': 3, 'row_step': 0},
                                     {'width': 2**31, 'point_step': 2**31}])
def test_too_little_data_is_refused(cloud, changes):
    for name, value in changes.items():
        setattr(cloud, name, value)
    refused(cloud, r'The cloud declares \d+ x \d+ points of \d+ bytes, in rows of')


@pytest.mark.parametrize('row_step', [0, 7, 10**6])
def test_a_single_row_needs_no_row_step(cloud, row_step):
    expected = points_of(do_transform_cloud(cloud, TURN)).tolist()
    cloud.row_step = row_step
    moved = do_transform_cloud(cloud, TURN)
    assert points_of(moved).tolist() == expected
    assert moved.row_step == row_step


def test_last_row_needs_no_padding():
    padded = make_cloud(random_columns(np.random.default_rng(8), 6, 'f4'),
                        {'x': 0, 'y': 4, 'z': 8}, 12, height=2, row_padding=10)
    expected = points_of(padded).tolist()
    padded.data = padded.data[:-10]
    assert points_of(padded).tolist() == expected


# --- points, reading, creating


def test_points_go_by_the_matrix():
    points = np.random.default_rng(9).normal(size=(7, 3))
    for transform in (stamped_transform(POSE), stamped_transform(POSE).transform):
        moved = transform_points(points, transform)
        assert moved == pytest.approx(se3.apply_many(POSE, points))
    assert transform_points([(1, 2, 3)], TURN) == pytest.approx(np.array([[-2.0, 1.0, 3.0]]))
    assert transform_points(points.astype('f4'), TURN).dtype == float
    assert transform_points(np.zeros((0, 3)), TURN).shape == (0, 3)


@pytest.mark.parametrize('big', [False, True])
@pytest.mark.parametrize(('kinds', 'expected'), [
    (('f4', 'f4', 'f4'), 'f4'), (('f8', 'f8', 'f8'), 'f8'), (('f4', 'f8', 'f4'), 'f8')])
def test_points_are_read_in_the_types_they_have(kinds, expected, big):
    rng = np.random.default_rng(10)
    columns = {name: rng.normal(size=4).astype(kind) for name, kind in zip('xyz', kinds,
                                                                           strict=True)}
    cloud = make_cloud(columns, {'x': 0, 'y': 8, 'z': 16}, 24, height=2, row_padding=3, big=big)
    points = points_of(cloud)
    assert points.dtype == np.dtype(expected)
    assert points.dtype.isnative
    assert points.tolist() == np.stack(list(columns.values()), axis=1).tolist()


@pytest.mark.parametrize(('row_padding', 'shape'), [(0, (1, 6)), (4, (3, 2))])
def test_rows_without_padding_are_one(row_padding, shape):
    cloud = make_cloud(random_columns(np.random.default_rng(11), 6, 'f4'),
                       {'x': 0, 'y': 4, 'z': 8}, 12, height=3, row_padding=row_padding)
    assert point_cloud.field_column(cloud, 'x').shape == shape


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
