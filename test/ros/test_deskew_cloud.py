# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The scans of a lidar on a robot that drives and rotates, as PointCloud2."""

from copy import deepcopy
import importlib
import math
import re

from hand_clock import clock_of_logs
from inputs import for_each
from lidar_scene import driving, scan, SCAN_TIME, SECOND, thickness, WALL_X
from message_tools import make_cloud
import numpy as np
import pytest
from rclpy.time import Time
from ros_helpers import lasting, PATIENCE, transform, until_waiting
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Header
from tf_tree_py import (
    Buffer,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
)
from tf_tree_py.beyond.motion.scans import (
    deskew,
    field_column,
    point_times,
    points_of,
    UNITS,
    write_points,
)
from tf_tree_py.ros.messages import deskew_cloud as module
from tf_tree_py.ros.messages.convert import as_nanoseconds, time_message
from tf_tree_py.ros.messages.deskew_cloud import deskew_cloud
from tf_tree_py.ros.messages.point_cloud import as_cloud, packed_cloud

# Present-day stamps, where a float64 of seconds resolves 240 ns.
CALENDAR, SIMULATED = 1_790_000_000 * SECOND, 10 * SECOND


def cloud_of(points, start, **times):
    columns = {**dict(zip('xyz', points.T.astype(np.float32), strict=True)), **times}
    return packed_cloud(Header(frame_id='lidar', stamp=time_message(start)), columns, True)


def scanned():
    """Return a scan of today as a cloud with offsets in nanoseconds."""
    points, stamps = scan(CALENDAR)
    return cloud_of(points, CALENDAR, t=(stamps - CALENDAR).astype('u4'))


@pytest.fixture(autouse=True)
def nothing_logged():
    """Let every test log as the first clouds of a process do."""
    yield
    forget()


def forget():
    importlib.reload(module)


# --- the wall


# The time fields of drivers: name, type, nanoseconds of the unit, whether they count from the
# header's stamp, and the error in nanoseconds, of stamps of today and of small ones.
@for_each(start=[CALENDAR, SIMULATED], field_type=[
    ('t', 'u4', 1, True, (0, 0)),
    ('time', 'f4', 1e9, True, (20, 20)),
    ('offset_time', 'u4', 1, True, (0, 0)),
    ('timestamp', 'f8', 1, False, (256, 1)),
    ('timestamp', 'f8', 1e9, False, (300, 2)),
    ('t', 'u4', 1000, True, (1000, 1000)),
    ('time', 'f4', 1e3, True, (20, 20)),
    ('time', 'f4', 1e6, True, (20, 20)),
    ('timestamp', 'f8', 1e9, True, (1, 1)),
    ('t', 'i4', 1, True, (0, 0)),
])
def test_wall_is_flat_only_after_deskewing(start, field_type):
    points, stamps = scan(start)
    field, dtype, unit, is_offset, errors = field_type
    told = stamps - start if is_offset else stamps
    told = (told / unit if dtype[0] == 'f' else told // unit).astype(dtype)
    cloud = cloud_of(points, start, **{field: told})
    times = point_times(cloud)
    assert np.abs(times.stamps - stamps).max() <= errors[start == SIMULATED]
    assert times.valid.all()
    assert times.field == field

    assert thickness(points_of(cloud)) > 0.02
    moved = deskew_cloud(driving(start), cloud, 'lidar')
    assert thickness(points_of(moved)) < 0.001
    assert moved.header == cloud.header
    exact = deskew(driving(start), points, stamps, 'lidar', 'lidar', start)
    assert points_of(moved) == pytest.approx(exact, rel=1e-6, abs=2e-5)


SWITCHED_ON = CALENDAR - 1000 * SECOND


# The stamp may be that of the end, and the times may count from when the lidar was switched on.
@for_each(start_and_options=[
    (CALENDAR + 124_975_000, {}),
    (SWITCHED_ON, {'unit': 's', 'origin': Time(nanoseconds=SWITCHED_ON)})])
def test_wall_stands_still_in_odom_whatever_the_times_count_from(start_and_options):
    zero, options = start_and_options
    points, stamps = scan(CALENDAR)
    stamp = CALENDAR if options else zero
    cloud = cloud_of(points, stamp, mine=(stamps - zero) / 1e9)
    moved = deskew_cloud(driving(CALENDAR), cloud, 'odom', field='mine', **options)
    assert points_of(moved)[:, 0] == pytest.approx(WALL_X, abs=0.001)
    assert (moved.header.frame_id, moved.header.stamp) == ('odom', cloud.header.stamp)


@for_each(reference_and_stamp=[
    (Time(nanoseconds=CALENDAR + SCAN_TIME), CALENDAR + SCAN_TIME),
    (time_message(CALENDAR + SCAN_TIME), CALENDAR + SCAN_TIME),
    (Time(), CALENDAR + 3 * SCAN_TIME - SECOND // 200),
])
def test_reference_is_any_time(reference_and_stamp):
    reference, stamp = reference_and_stamp
    moved = deskew_cloud(driving(CALENDAR), scanned(), 'base_link', reference_stamp=reference)
    assert as_nanoseconds(moved.header.stamp) == stamp
    exact = deskew(driving(CALENDAR), *scan(CALENDAR), 'base_link', 'lidar', stamp)
    assert points_of(moved) == pytest.approx(exact, rel=1e-6, abs=2e-5)


def test_frame_of_the_cloud_is_the_default_and_assumptions_are_logged(capfd):
    buffer, cloud = driving(CALENDAR), scanned()
    moved = [deskew_cloud(buffer, cloud), deskew_cloud(buffer, cloud)]
    assert moved == [deskew_cloud(buffer, cloud, 'lidar', 'odom', cloud.header.stamp)] * 2
    logged = capfd.readouterr().err
    assert logged.count("Deskewing clouds in 'lidar': the field 't' (uint32) holds ns from") == 1


def test_clouds_of_invented_frames_are_logged_in_a_few_lines(capfd, monkeypatch):
    clock = clock_of_logs(monkeypatch)
    buffer, cloud = driving(CALENDAR), scanned()

    def deskew_those(*numbers):
        for number in numbers:
            cloud.header.frame_id = f'frame_{number}'
            with pytest.raises(LookupException):
                deskew_cloud(buffer, cloud)
        return re.findall("Deskewing clouds in 'frame_([0-9]+)'", capfd.readouterr().err)

    logged = deskew_those(*range(100))
    assert len(logged) == 11
    # A line that was left out is written when there is room for it; others are not repeated.
    clock.now += 60.0
    assert deskew_those(*logged, 99) == ['99']


def test_layout_and_other_fields_are_kept():
    packed = scanned()
    columns = {name: field_column(packed, name).reshape(-1) for name in 'xyzt'}
    cloud = make_cloud({**columns, 'ring': np.arange(2000, dtype='u2')},
                       {'x': 3, 'y': 12, 'z': 20, 't': 24, 'ring': 1}, 30, height=4,
                       row_padding=100, big=True)
    cloud.header = packed.header
    before = deepcopy(cloud)
    moved = deskew_cloud(driving(CALENDAR), cloud)
    expected = points_of(deskew_cloud(driving(CALENDAR), packed))
    assert points_of(moved).tolist() == expected.tolist()
    assert cloud == before
    assert moved.fields[0] is not cloud.fields[0]
    # With the old coordinates put back, every byte is as before.
    write_points(moved, points_of(cloud))
    assert moved == cloud


def test_rays_of_a_laser_scan_have_the_times_to_deskew_them():
    message = LaserScan(header=Header(frame_id='lidar', stamp=time_message(CALENDAR)),
                        ranges=[1.0, 2.0, 3.0], range_max=9.0, time_increment=0.25)
    times = point_times(as_cloud(message))
    assert (times.stamps - CALENDAR).tolist() == [0, SECOND // 4, SECOND // 2]


# --- invalid points


def test_holes_stay_and_a_point_without_a_time_becomes_one():
    points, stamps = scan(CALENDAR)
    offsets = (stamps - CALENDAR) / 1e9
    offsets[7] = np.nan
    moved = deskew_cloud(driving(CALENDAR), cloud_of(points, CALENDAR, time=offsets))
    assert np.isnan(points_of(moved)).any(axis=1).nonzero()[0].tolist() == [7]
    assert not moved.is_dense

    points[3], points[5, 1] = np.nan, np.inf
    # Points that were not measured may have any time, or none.
    offsets[3], offsets[5] = 1e300, np.nan
    cloud = cloud_of(points, CALENDAR, time=offsets)
    moved = points_of(deskew_cloud(driving(CALENDAR), cloud))
    assert np.isnan(moved[3]).all()
    assert moved[5].tolist() == points_of(cloud)[5].tolist()
    assert np.isfinite(np.delete(moved, [3, 5, 7], axis=0)).all()

    # Holes alone need no transforms.
    cloud = cloud_of(np.full((5, 3), np.nan), CALENDAR, t=np.full(5, 2**31, dtype='u4'))
    assert np.isnan(points_of(deskew_cloud(driving(CALENDAR), cloud))).all()


@for_each(fields=[('x', 'y', 'z', 't'), ('x', 'y', 'z'), ()])
def test_empty_cloud_stays_empty(fields):
    cloud = packed_cloud(Header(), {name: np.ones(0) for name in fields}, True) if fields else (
        PointCloud2())
    cloud.header = Header(frame_id='lidar', stamp=time_message(CALENDAR))
    moved = deskew_cloud(driving(CALENDAR), cloud, 'odom')
    assert (len(moved.data), moved.header.frame_id) == (0, 'odom')


# --- detected formats, and refused ones


def some_cloud(start=CALENDAR, **times):
    return cloud_of(np.ones((len(next(iter(times.values()))), 3)), start, **times)


U4, TODAY = np.array([0, 3, 7], dtype='u4'), np.array([CALENDAR])


# The furthest of the stamps, nanoseconds from that of the cloud.
@pytest.mark.parametrize(('field', 'values', 'options', 'unit', 'furthest'), [
    ('t', U4, {'unit': 's'}, 's', 7 * SECOND),
    ('t', U4, {'unit': 'ns'}, 'ns', 7),
    ('mine', np.array([0.0, 0.05]), {'field': 'mine'}, 's', SECOND // 20),
    ('time', np.array([1000.0, 1000.1]), {'unit': 's', 'origin': SWITCHED_ON}, 's', SECOND // 10),
    ('time', np.array([0.0, 0.5, 1.0]), {'unit': 0.1}, 'multiples of 0.1 s', SECOND // 10),
    ('t', np.array([0, 1000], dtype='u2'), {'unit': 1e-4}, 'multiples of 0.0001 s', SECOND // 10),
    ('t', np.array([0, 500], dtype='u4'), {}, 'ms', 500_000_000),
    ('t', np.array([0, 99_000], dtype='u4'), {}, 'us', 99_000_000),
    ('t', np.array([0, 2_000_000], dtype='u4'), {}, 'ns', 2_000_000),
    ('t', np.array([-100_000_000, 0], dtype='i4'), {}, 'ns', 0),
    ('time', np.array([0.0, 1e-4]), {}, 's', 100_000),
    ('time', np.array([0.0, 4.0]), {}, 's', 4 * SECOND),
    ('time', np.array([0.0, 99.0]), {}, 'ms', 99_000_000),
    ('time', np.array([-0.1, 0.0]), {}, 's', 0),
    ('time', np.array([0.0, 1e8]), {}, 'ns', 100_000_000),
    ('timestamp', TODAY / 1e9, {}, 's', 0),
    ('timestamp', TODAY.astype('f8'), {}, 'ns', 0),
    ('timestamp', TODAY / 1e3, {}, 'us', 0),
    ('time', TODAY / 1e9, {}, 's', 0),
])
def test_unit_is_inferred_unless_it_is_told(field, values, options, unit, furthest):
    times = point_times(some_cloud(ring=np.zeros(len(values), dtype='u4'), **{field: values}),
                        **options)
    assert (times.field, times.unit) == (field, unit)
    if values is U4:
        assert (times.stamps - CALENDAR).tolist() == [0, furthest // 7 * 3, furthest]
    # A float64 of seconds resolves no more, today.
    error = 300 if values is not U4 and values[0] > 1e8 else 0
    assert abs(int(times.stamps.max()) - CALENDAR - furthest) <= error


def test_stamps_by_a_simulated_clock_are_told_from_offsets():
    stamps = np.array([SIMULATED, SIMULATED + SCAN_TIME])
    for values in (stamps / 1e9, stamps / 1e6, stamps.astype('f8')):
        times = point_times(some_cloud(SIMULATED, timestamp=values))
        assert np.abs(times.stamps - stamps).max() <= 2
        assert times.origin == 0
    times = point_times(some_cloud(SIMULATED, timestamp=stamps.astype('f8')), unit='ns', origin=0)
    assert times.stamps.tolist() == stamps.tolist()
    offsets = point_times(some_cloud(SIMULATED, timestamp=np.array([0.0, 0.1])))
    assert (offsets.stamps.tolist(), offsets.origin) == (stamps.tolist(), SIMULATED)


@pytest.mark.parametrize(('times', 'options', 'sentence'), [
    ({'ring': U4}, {}, r'none of t, time, timestamp, offset_time is among its fields '
                       r'\(x, y, z, ring\)'),
    ({'t': U4}, {'field': 'when'}, "no field 'when'"),
    *[({'t': U4}, {'unit': unit}, f'one of s, ms, us, ns, or a number of .* to 60, not {unit!r}')
      for unit in ('h', 0, -0.1, math.nan, 61.0)],
    ({'time': np.array([1000.0, 1000.1])}, {'unit': 's'},
     r"in the field 'time', read as s, begin 1000.000 s from.*as origin"),
    ({'timestamp': TODAY / 1e9 + 3600}, {'unit': 's'}, 'read as s, begin 3600.000 s from'),
    ({'t': np.array([0.0, 3600.0])}, {'unit': 's'}, 'pass the stamp of that moment as'),
    ({'t': np.array([-3600.0, 0.0])}, {'unit': 's'}, 'pass the stamp of that moment as'),
])
def test_times_that_cannot_be_read_are_refused(times, options, sentence):
    with pytest.raises(InvalidArgumentException, match=sentence):
        point_times(some_cloud(**times), **options)


@pytest.mark.parametrize(('options', 'sentence'), [
    ({}, r"the field 't' \(uint32\) holds ns from the cloud's stamp \(assumed: unit and zero\)"),
    ({'unit': 'ns'}, r"holds ns from the cloud's stamp \(assumed: zero\)"),
    ({'unit': 'ns', 'origin': SECOND}, r'holds ns from 1\.000000000 s$'),
])
def test_reading_says_what_was_assumed(options, sentence):
    times = point_times(some_cloud(SECOND, t=np.array([0, 10**8], dtype='u4')), **options)
    assert re.search(sentence, times.reading)
    since_1970 = point_times(some_cloud(timestamp=TODAY / 1e9))
    assert "(float64) holds s from the clock's zero (assumed" in since_1970.reading


# --- times that are coarse


def float32(*seconds, unit=1.0):
    return (np.array(seconds) / unit).astype(np.float32)


@for_each(unit=[1.0, 1e-3, 1e-6, 1e-9], field=['time', 'timestamp'],
          options=[{}, {'origin': 0}], late=[0.0, -59.0, 59.0])
def test_float32_since_1970_is_refused(unit, field, options, late):
    """Its steps are 128 s. The nearest of them may be more than a minute from the stamp."""
    for second in range(0, 128, 16):
        start = CALENDAR + second * SECOND
        times = float32(start / 1e9 + late, start / 1e9 + late + 0.1, unit=unit)
        with pytest.raises(
                InvalidArgumentException,
                match=rf"field '{field}' is float32 and holds 1\.?7[89].* has steps of 1\d\d\."
                      '.*write FLOAT64, or times relative to the stamp'):
            point_times(some_cloud(start, **{field: times}), **options)


# Seconds since the lidar was switched on, and the step of float32 there.
@pytest.mark.parametrize(('since', 'outcome'), [
    (16_000, 'fine'), (20_000, '1.953 ms'), (130_000, '7.812 ms'), (140_000, 'refused')])
def test_float32_since_the_start_of_the_lidar_is_doubted_and_then_refused(since, outcome):
    cloud = some_cloud(time=float32(since, since + 0.1))
    options = {'unit': 's', 'origin': CALENDAR - since * SECOND}
    if outcome == 'refused':
        with pytest.raises(InvalidArgumentException, match='float32 has steps of 15.62 ms, too'):
            point_times(cloud, **options)
        return
    times = point_times(cloud, **options)
    assert abs(int(times.stamps.max()) - CALENDAR - SECOND // 10) <= 4_000_000
    assert outcome == 'fine' or f'steps of {outcome}' in times.doubt
    assert bool(times.doubt) == (outcome != 'fine')


@for_each(times=[(0.0, 0.1), (-0.1, 0.0), (0.0, 4.0), (-59.0, 59.0), (0.0, 0.0)],
          unit=UNITS.items())
def test_float32_after_the_stamp_is_never_coarse(times, unit):
    name, size = unit
    cloud = some_cloud(time=float32(*times, unit=size / 1e9))
    assert point_times(cloud, unit=name).doubt == ''


def test_coarse_times_are_logged_once(capfd, monkeypatch):
    clock = clock_of_logs(monkeypatch)
    since = 20_000
    cloud = some_cloud(time=float32(since, since + 0.1))
    buffer, origin = driving(CALENDAR), Time(nanoseconds=CALENDAR - since * SECOND)
    for _ in range(3):
        deskew_cloud(buffer, cloud, unit='s', origin=origin)
        clock.now += 60.0
    logged = capfd.readouterr().err
    assert logged.count('[WARN]') == 1
    assert "in 'lidar': The field 'time' is float32 and holds 20000.09961, read as s" in logged


# --- fractions of a scan


def log_of_clouds(capfd, interval, times, **options):
    """Deskew three clouds, some seconds apart; return what is logged."""
    buffer = Buffer()
    buffer.set_transform_static(transform('odom', 'lidar', w=1.0))
    for number in range(3):
        cloud = some_cloud(CALENDAR + round(number * interval * 1e9), time=times)
        deskew_cloud(buffer, cloud, **options)
    return capfd.readouterr().err


@for_each(times=[float32(0.0, 0.5, 1.0), float32(0.0, 0.4, 0.95), float32(-1.0, 0.0)],
          interval=[0.05, 0.1, 0.5])
def test_fractions_of_a_scan_cause_one_warning(capfd, times, interval):
    forget()
    log = log_of_clouds(capfd, interval, times)
    assert log.count('[WARN]') == 1
    assert re.search(
        r"in 'lidar': the times in the field 'time' span (1|0\.95), read as seconds, but the "
        rf'stamps of two clouds are {interval * 1e3:.0f} ms apart. If these are fractions of a '
        r'scan, pass its duration in seconds as unit, such as unit=0.1; if .*, pass unit=', log)


# A lidar that turns once a second, one that turns ten times, two halves of a scan, and clouds of a
# known unit: fractions, or points of ten scans, sent after each of them.
@pytest.mark.parametrize(('interval', 'times', 'options'), [
    (1.0, float32(0.0, 0.9999), {}),
    (0.8, float32(0.0, 1.0), {}),
    (0.1, float32(0.0, 0.1), {}),
    (0.0, float32(0.0, 1.0), {}),
    (0.1, float32(0.0, 1.0), {'unit': 0.1}),
    (0.1, float32(0.0, 1.0), {'unit': 's'}),
    (0.1, float32(0.0, 2.0), {}),
])
def test_seconds_cause_no_warning(capfd, interval, times, options):
    assert '[WARN]' not in log_of_clouds(capfd, interval, times, **options)


def test_one_cloud_of_fractions_is_no_evidence_and_the_log_says_what_to_pass(capfd):
    log = log_of_clouds(capfd, 0.0, float32(0.0, 1.0))
    assert re.search(r'\[INFO\].*holds s from the.*If these are fractions.*such as unit=0.1$',
                     log, re.MULTILINE)


def test_clouds_of_two_lidars_are_not_compared(capfd):
    buffer = Buffer()
    for frame in ('left', 'right'):
        buffer.set_transform_static(transform('odom', frame, w=1.0))
    for number in range(4):
        cloud = some_cloud(CALENDAR + number * SECOND // 2, time=float32(0.0, 0.99))
        cloud.header.frame_id = ('left', 'right')[number % 2]
        deskew_cloud(buffer, cloud)
    assert '[WARN]' not in capfd.readouterr().err


# --- waiting


def test_scan_beyond_the_buffer_is_refused():
    cloud = scanned()
    cloud.header.stamp.sec += 2
    with pytest.raises(ExtrapolationException):
        deskew_cloud(driving(CALENDAR), cloud)


def test_timeout_waits_for_the_last_point_and_the_reference(pool):
    buffer = Buffer()
    buffer.set_transform_static(transform('base_link', 'lidar', w=1.0))
    buffer.set_transform(transform('odom', 'base_link', 1.0))
    cloud = some_cloud(SECOND, t=np.array([0, 10**9], dtype='u4'))
    waiting = pool.submit(deskew_cloud, buffer, cloud, 'map', timeout=PATIENCE)
    until_waiting(buffer)
    buffer.set_transform(transform('odom', 'base_link', 1.5, x=0.5))
    assert not waiting.done()
    buffer.set_transform(transform('map', 'odom', 0.5))
    buffer.set_transform(transform('odom', 'base_link', 2.0, x=1.0))
    until_waiting(buffer)
    buffer.set_transform(transform('map', 'odom', 1.5, x=2.0))
    assert points_of(waiting.result()).tolist() == [[2.0, 1.0, 1.0], [3.0, 1.0, 1.0]]
    with pytest.raises(ExtrapolationException, match='waited'):
        deskew_cloud(buffer, some_cloud(2 * SECOND, t=np.array([0, 10**9], dtype='u4')),
                     timeout=lasting(0.05))
