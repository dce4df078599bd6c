# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A spinning lidar on a robot that drives and rotates scans a flat wall, as PointCloud2."""

from copy import deepcopy
from functools import cache
import math
import re

from geometry_msgs.msg import TransformStamped
from inputs import for_each
import numpy as np
import pytest
from rclpy.time import Time
from ros_helpers import at, lasting, transform
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py import Buffer, BufferCore, ExtrapolationException, InvalidArgumentException, Pose
from tf_tree_py.core.deskew import deskew
from tf_tree_py.ros.messages import deskew_cloud as module
from tf_tree_py.ros.messages.convert import as_nanoseconds, time_message
from tf_tree_py.ros.messages.deskew_cloud import deskew_cloud
from tf_tree_py.ros.messages.laser_scan import as_cloud
from tf_tree_py.ros.messages.point_cloud import field_column, packed_cloud, points_of
from tf_tree_py.ros.messages.point_times import point_times

SECOND = 1_000_000_000
# Present-day stamps, where a float64 of seconds resolves 240 ns.
CALENDAR, SIMULATED = 1_790_000_000 * SECOND, 10 * SECOND
SCAN_TIME = SECOND // 10
SPEED, TURN_RATE = 1.0, 1.0
WALL_X = 5.0
base_T_lidar = Pose.from_xyz_rpy(x=0.2, z=0.8, yaw=0.3)


def odom_T_base(time_s):
    """Return the pose of a circle: metres a second ahead, radians a second to the left."""
    yaw = TURN_RATE * time_s
    radius = SPEED / TURN_RATE
    return Pose.from_xyz_rpy(
        x=radius * math.sin(yaw), y=radius * (1.0 - math.cos(yaw)), yaw=yaw)


def fill(buffer, start):
    buffer.insert('base_link', 'lidar', 0, base_T_lidar, static=True)
    # From before the scan until after it, at 200 Hz.
    for stamp in range(start - 2 * SCAN_TIME, start + 3 * SCAN_TIME, SECOND // 200):
        buffer.insert('odom', 'base_link', stamp, odom_T_base((stamp - start) / SECOND))
    return buffer


def driving(start):
    return fill(BufferCore(), start)


def scan(start):
    """Return (points, stamps) of two turns of the lidar, each sweeping the wall in a quarter."""
    points, offsets = two_turns()
    return points.copy(), start + offsets


@cache
def two_turns():
    sweep = np.arange(1000) * (SCAN_TIME // 4000)
    offsets = np.concatenate([sweep, SCAN_TIME + sweep])
    wall = np.stack([np.full(1000, WALL_X), np.linspace(-2.0, 2.0, 1000),
                     np.linspace(0.2, 1.5, 1000)], axis=1)
    points = [(odom_T_base(offset / SECOND) @ base_T_lidar).inverse() @ point
              for offset, point in zip(offsets.tolist(), [*wall, *wall], strict=True)]
    return np.array(points), offsets


def cloud_of(points, start, **times):
    columns = {**dict(zip('xyz', points.T.astype(np.float32), strict=True)), **times}
    header = Header(frame_id='lidar', stamp=time_message(start))
    return packed_cloud(header, columns, True)


def thickness(points):
    """Return the distance of points from their best plane, metres."""
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][-1]
    distances = centred @ normal
    return distances.max() - distances.min()


# The time fields of drivers: name, and value as a function of stamps and the header's stamp.
KINDS = {
    'ouster': ('t', lambda stamps, start: (stamps - start).astype('u4')),
    'velodyne': ('time', lambda stamps, start: ((stamps - start) / 1e9).astype('f4')),
    'livox': ('offset_time', lambda stamps, start: (stamps - start).astype('u4')),
    'livox 2': ('timestamp', lambda stamps, start: stamps.astype('f8')),
    'hesai': ('timestamp', lambda stamps, start: stamps / 1e9),
    'microseconds': ('t', lambda stamps, start: ((stamps - start) // 1000).astype('u4')),
    'float microseconds': ('time', lambda stamps, start: ((stamps - start) / 1e3).astype('f4')),
    'milliseconds': ('time', lambda stamps, start: ((stamps - start) / 1e6).astype('f4')),
    'double offsets': ('timestamp', lambda stamps, start: (stamps - start) / 1e9),
    'signed': ('t', lambda stamps, start: (stamps - start).astype('i4')),
}


@pytest.fixture(params=[CALENDAR, SIMULATED], ids=['calendar', 'simulated'])
def start(request):
    return request.param


@pytest.fixture(autouse=True)
def nothing_told(monkeypatch):
    monkeypatch.setattr(module, '_told', set())


# --- the wall


@for_each(kind=KINDS)
def test_wall_is_flat_only_after_deskewing(start, kind):
    points, stamps = scan(start)
    field, told = KINDS[kind]
    cloud = cloud_of(points, start, **{field: told(stamps, start)})
    assert thickness(points_of(cloud)) > 0.02
    moved = deskew_cloud(driving(start), cloud, 'lidar')
    assert thickness(points_of(moved)) < 0.001
    assert moved.header == cloud.header
    exact = deskew(driving(start), points, stamps, 'lidar', 'lidar', start)
    assert points_of(moved) == pytest.approx(exact, abs=2e-5)


@for_each(kind=KINDS)
def test_stamps_are_read_to_the_resolution_of_their_field(start, kind):
    points, stamps = scan(start)
    field, told = KINDS[kind]
    times = point_times(cloud_of(points, start, **{field: told(stamps, start)}))
    resolution = {'livox 2': 256 if start == CALENDAR else 1,
                  'hesai': 300 if start == CALENDAR else 2,
                  'microseconds': 1000, 'double offsets': 1}.get(kind, 0)
    if told(stamps, start).dtype == np.float32:
        resolution = 20
    assert np.abs(times.stamps - stamps).max() <= resolution
    assert times.valid.all()
    assert times.field == field


def test_scan_may_end_at_its_stamp():
    points, stamps = scan(CALENDAR)
    end = int(stamps.max())
    cloud = cloud_of(points, end, time=((stamps - end) / 1e9).astype('f4'))
    moved = deskew_cloud(driving(CALENDAR), cloud, 'odom')
    assert points_of(moved)[:, 0] == pytest.approx(WALL_X, abs=0.001)
    assert (moved.header.frame_id, moved.header.stamp) == ('odom', cloud.header.stamp)


@pytest.mark.parametrize(('reference', 'stamp'), [
    (Time(nanoseconds=CALENDAR + SCAN_TIME), CALENDAR + SCAN_TIME),
    (time_message(CALENDAR + SCAN_TIME), CALENDAR + SCAN_TIME),
    (Time(), CALENDAR + 3 * SCAN_TIME - SECOND // 200),
])
def test_reference_is_any_time(reference, stamp):
    points, stamps = scan(CALENDAR)
    cloud = cloud_of(points, CALENDAR, t=(stamps - CALENDAR).astype('u4'))
    moved = deskew_cloud(driving(CALENDAR), cloud, 'base_link', reference_stamp=reference)
    assert as_nanoseconds(moved.header.stamp) == stamp
    exact = deskew(driving(CALENDAR), points, stamps, 'base_link', 'lidar', stamp)
    assert points_of(moved) == pytest.approx(exact, abs=2e-5)


def test_frame_of_the_cloud_is_the_target_unless_told():
    points, stamps = scan(CALENDAR)
    cloud = cloud_of(points, CALENDAR, t=(stamps - CALENDAR).astype('u4'))
    assert deskew_cloud(driving(CALENDAR), cloud) == deskew_cloud(
        driving(CALENDAR), cloud, 'lidar', 'odom', cloud.header.stamp)


def test_layout_and_other_fields_are_kept():
    points, stamps = scan(CALENDAR)
    big = {name: values.astype('>f4') for name, values in zip('xyz', points.T, strict=True)}
    record = np.zeros((4, 500), dtype={'names': [*big, 't', 'ring'], 'offsets': [3, 12, 20, 24, 1],
                                       'formats': ['>f4', '>f4', '>f4', '>u4', '>u2'],
                                       'itemsize': 30})
    for name, values in big.items():
        record[name] = values.reshape(4, 500)
    record['t'] = (stamps - CALENDAR).reshape(4, 500)
    record['ring'] = np.arange(2000).reshape(4, 500)
    cloud = cloud_of(points, CALENDAR, t=(stamps - CALENDAR).astype('u4'),
                     ring=np.arange(2000, dtype='u2'))
    expected = points_of(deskew_cloud(driving(CALENDAR), cloud))
    for field in cloud.fields:
        field.offset = record.dtype.fields[field.name][1]
    cloud.height, cloud.width, cloud.point_step, cloud.row_step = 4, 500, 30, 15_100
    cloud.is_bigendian = True
    cloud.data = b''.join(row.tobytes() + bytes(100) for row in record)
    before = deepcopy(cloud)
    moved = deskew_cloud(driving(CALENDAR), cloud)
    assert points_of(moved).tolist() == expected.tolist()
    assert cloud == before
    for name in ('t', 'ring'):
        assert (field_column(moved, name) == field_column(cloud, name)).all()
    assert (moved.height, moved.width, moved.row_step) == (4, 500, 15_100)
    assert moved.fields == cloud.fields
    assert moved.fields[0] is not cloud.fields[0]


def test_a_laser_scan_is_deskewed_too():
    rays = np.linspace(-0.3, 0.3, 200)
    offsets = np.arange(200) * (SCAN_TIME // 200)
    ranges = []
    for angle, offset in zip(rays, offsets, strict=True):
        odom_T_lidar = odom_T_base(offset / SECOND) @ base_T_lidar
        ahead = np.array(odom_T_lidar @ [math.cos(angle), math.sin(angle), 0.0])
        ranges.append((WALL_X - odom_T_lidar.x) / (ahead[0] - odom_T_lidar.x))
    message = LaserScan(header=Header(frame_id='lidar', stamp=time_message(CALENDAR)),
                        angle_min=-0.3, angle_increment=0.6 / 199, range_max=100.0,
                        time_increment=SCAN_TIME / 200 / SECOND, ranges=ranges)
    in_odom = deskew_cloud(driving(CALENDAR), as_cloud(message), 'odom')
    assert points_of(in_odom)[:, 0] == pytest.approx(WALL_X, abs=0.001)


# --- invalid points


def test_holes_stay_and_do_not_count():
    points, stamps = scan(CALENDAR)
    offsets = (stamps - CALENDAR) / 1e9
    points[3], points[5, 1] = np.nan, np.inf
    # Points that were not measured may have any time, or none.
    offsets[3], offsets[5] = 1e300, np.nan
    cloud = cloud_of(points, CALENDAR, time=offsets)
    cloud.is_dense = False
    moved = points_of(deskew_cloud(driving(CALENDAR), cloud))
    assert np.isnan(moved[3]).all()
    assert moved[5].tolist() == points_of(cloud)[5].tolist()
    assert np.isfinite(np.delete(moved, [3, 5], axis=0)).all()


def test_a_point_without_a_time_becomes_a_hole():
    points, stamps = scan(CALENDAR)
    offsets = (stamps - CALENDAR) / 1e9
    offsets[7] = np.nan
    cloud = cloud_of(points, CALENDAR, time=offsets)
    assert cloud.is_dense
    moved = deskew_cloud(driving(CALENDAR), cloud)
    assert np.isnan(points_of(moved)).any(axis=1).nonzero()[0].tolist() == [7]
    assert not moved.is_dense


@pytest.mark.parametrize('fields', [('x', 'y', 'z', 't'), ('x', 'y', 'z'), ()])
def test_an_empty_cloud_stays_empty(fields):
    cloud = packed_cloud(Header(), {name: np.ones(0) for name in fields}, True) if fields else (
        PointCloud2())
    cloud.header = Header(frame_id='lidar', stamp=time_message(CALENDAR))
    moved = deskew_cloud(driving(CALENDAR), cloud, 'odom')
    assert (len(moved.data), moved.header.frame_id) == (0, 'odom')


def test_a_cloud_of_holes_needs_no_transforms():
    cloud = cloud_of(np.full((5, 3), np.nan), CALENDAR, t=np.full(5, 2**31, dtype='u4'))
    moved = deskew_cloud(driving(CALENDAR), cloud)
    assert np.isnan(points_of(moved)).all()


# --- detected formats, and refused ones


def some_cloud(start=CALENDAR, **times):
    count = len(next(iter(times.values())))
    return cloud_of(np.ones((count, 3)), start, **times)


@pytest.mark.parametrize('unit', ['s', 'ms', 'us', 'ns'])
def test_unit_is_believed(unit):
    times = point_times(some_cloud(t=np.array([0, 3, 7], dtype='u4')), unit=unit)
    size = {'s': SECOND, 'ms': SECOND // 1000, 'us': 1000, 'ns': 1}[unit]
    assert (times.stamps - CALENDAR).tolist() == [0, 3 * size, 7 * size]
    assert times.unit == unit


def test_origin_is_believed():
    since_start = np.array([1000.0, 1000.1])
    cloud = some_cloud(time=since_start)
    with pytest.raises(InvalidArgumentException,
                       match=r"in the field 'time', read as s, begin 1000.000 s from.*as origin"):
        point_times(cloud, unit='s')
    times = point_times(cloud, unit='s', origin=CALENDAR - 1000 * SECOND)
    assert (times.stamps - CALENDAR).tolist() == [0, SECOND // 10]
    simulated = some_cloud(SIMULATED, t=np.array([SIMULATED, SIMULATED + 5], dtype='f8'))
    assert (point_times(simulated, unit='ns', origin=0).stamps - SIMULATED).tolist() == [0, 5]


def test_origin_and_unit_reach_the_deskewing():
    points, stamps = scan(CALENDAR)
    switched_on = CALENDAR - 1000 * SECOND
    cloud = cloud_of(points, CALENDAR, sensor_time=(stamps - switched_on) / 1e6)
    moved = deskew_cloud(driving(CALENDAR), cloud, 'odom', field='sensor_time', unit='ms',
                         origin=Time(nanoseconds=switched_on))
    assert points_of(moved)[:, 0] == pytest.approx(WALL_X, abs=0.001)


def test_field_is_believed():
    cloud = some_cloud(t=np.array([9, 9], dtype='u4'), mine=np.array([0.0, 0.05]))
    assert (point_times(cloud, 'mine').stamps - CALENDAR).tolist() == [0, SECOND // 20]
    assert point_times(cloud).field == 't'


@pytest.mark.parametrize(('field', 'values', 'unit', 'furthest'), [
    ('t', np.array([0, 500], dtype='u4'), 'ms', 500_000_000),
    ('t', np.array([0, 99_000], dtype='u4'), 'us', 99_000_000),
    ('t', np.array([0, 2_000_000], dtype='u4'), 'ns', 2_000_000),
    ('t', np.array([-100_000_000, 0], dtype='i4'), 'ns', 0),
    ('time', np.array([0.0, 1e-4]), 's', 100_000),
    ('time', np.array([0.0, 4.0]), 's', 4 * SECOND),
    ('time', np.array([0.0, 99.0]), 'ms', 99_000_000),
    ('time', np.array([-0.1, 0.0]), 's', 0),
    ('time', np.array([0.0, 1e8]), 'ns', 100_000_000),
    ('timestamp', np.array([CALENDAR / 1e9, CALENDAR / 1e9]), 's', 0),
    ('timestamp', np.array([CALENDAR, CALENDAR], dtype='f8'), 'ns', 0),
    ('timestamp', np.array([CALENDAR / 1e3, CALENDAR / 1e3]), 'us', 0),
    ('time', np.array([CALENDAR / 1e9]), 's', 0),
])
def test_unit_is_inferred_from_type_and_range(field, values, unit, furthest):
    times = point_times(some_cloud(**{field: values}))
    assert times.unit == unit
    assert int(times.stamps.max()) - CALENDAR == pytest.approx(furthest, abs=300)


def test_stamps_by_a_simulated_clock_are_told_from_offsets():
    stamps = np.array([SIMULATED, SIMULATED + SCAN_TIME])
    for values in (stamps / 1e9, stamps / 1e6, stamps.astype('f8')):
        times = point_times(some_cloud(SIMULATED, timestamp=values))
        assert times.stamps == pytest.approx(stamps, abs=2)
        assert times.origin == 0
    offsets = point_times(some_cloud(SIMULATED, timestamp=np.array([0.0, 0.1])))
    assert offsets.stamps.tolist() == stamps.tolist()
    assert offsets.origin == SIMULATED


def test_cloud_without_times_is_refused_by_name():
    with pytest.raises(InvalidArgumentException, match=r'none of t, time, timestamp, offset_time '
                                                       r'is among its fields \(x, y, z, ring\)'):
        point_times(some_cloud(ring=np.zeros(2, dtype='u2')))
    with pytest.raises(InvalidArgumentException, match="no field 'when'"):
        point_times(some_cloud(t=np.zeros(2)), 'when')


def test_unknown_unit_is_refused():
    with pytest.raises(InvalidArgumentException, match="unit is one of s, ms, us, ns, not 'h'"):
        point_times(some_cloud(t=np.zeros(2)), unit='h')


def test_times_far_from_the_stamp_are_refused():
    with pytest.raises(InvalidArgumentException, match='read as s, begin 3600.000 s from'):
        point_times(some_cloud(timestamp=np.array([CALENDAR / 1e9 + 3600])), unit='s')
    for offsets in ([0.0, 3600.0], [-3600.0, 0.0]):
        with pytest.raises(InvalidArgumentException, match='pass the stamp of that moment as'):
            point_times(some_cloud(t=np.array(offsets)), unit='s')


@pytest.mark.parametrize(('given', 'sentence'), [
    ({}, r"the field 't' \(uint32\) holds ns from the cloud's stamp \(assumed: unit and zero\)"),
    ({'unit': 'ns'}, r"holds ns from the cloud's stamp \(assumed: zero\)"),
    ({'unit': 'ns', 'origin': 10**9}, r'holds ns from 1\.000000000 s$'),
])
def test_reading_says_what_was_assumed(given, sentence):
    times = point_times(some_cloud(SECOND, t=np.array([0, 10**8], dtype='u4')), **given)
    assert re.search(sentence, times.reading)
    since_1970 = point_times(some_cloud(timestamp=np.array([CALENDAR / 1e9])))
    assert "(float64) holds s from the clock's zero (assumed" in since_1970.reading


def test_assumption_is_logged_once(capfd):
    points, stamps = scan(CALENDAR)
    buffer = driving(CALENDAR)
    cloud = cloud_of(points, CALENDAR, t=(stamps - CALENDAR).astype('u4'))
    for _ in range(3):
        deskew_cloud(buffer, cloud)
    logged = capfd.readouterr().err
    assert logged.count("Deskewing clouds in 'lidar': the field 't' (uint32) holds ns from") == 1


# --- waiting


def test_scan_beyond_the_buffer_is_refused():
    points, stamps = scan(CALENDAR)
    cloud = cloud_of(points, CALENDAR + 2 * SECOND, t=(stamps - CALENDAR).astype('u4'))
    with pytest.raises(ExtrapolationException):
        deskew_cloud(driving(CALENDAR), cloud)


def test_timeout_waits_for_the_last_point(pool):
    buffer = Buffer()
    buffer.set_transform_static(transform('base_link', 'lidar', w=1.0))
    buffer.set_transform(transform('odom', 'base_link', 1.0))
    cloud = some_cloud(SECOND, t=np.array([0, 10**9], dtype='u4'))
    waiting = pool.submit(deskew_cloud, buffer, cloud, 'odom', timeout=lasting(20))
    buffer.set_transform(transform('odom', 'base_link', 1.5, x=0.5))
    assert not waiting.done()
    buffer.set_transform(transform('odom', 'base_link', 2.0, x=1.0))
    assert points_of(waiting.result()).tolist() == [[1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]
    assert isinstance(buffer.lookup_transform('odom', 'lidar', at(2)), TransformStamped)
    with pytest.raises(ExtrapolationException, match='waited'):
        deskew_cloud(buffer, some_cloud(2 * SECOND, t=np.array([0, 10**9], dtype='u4')),
                     timeout=lasting(0.05))
