# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Measure the transformation of messages: OPENBLAS_NUM_THREADS=1 python benchmark/stamped_bench.py.

The argument is the number of rounds. Without that variable, the peer's product of small
matrices is spread over threads, and waits for them on a busy machine.

Each row is compared with a peer in the same run. Both run in every round, one after the
other; the results are medians of all rounds. Two ratios have a target: a polygon of 100 points
to a point (15), and a cloud of 300,000 points to the bare matrix product on a packed float32
copy of it (2.5).
"""

from array import array
from collections.abc import Callable
from functools import partial
import os
import statistics
import sys
import time

from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    Point,
    Point32,
    PointStamped,
    Polygon,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
)
from nav_msgs.msg import Odometry, Path
import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from tf_tree_py import Buffer
from tf_tree_py.core.geometry import so3
from tf_tree_py.core.stamp import NANOSECONDS_PER_SECOND
from tf_tree_py.ros.messages.convert import transform_stamped
from tf_tree_py.ros.messages.deskew_cloud import deskew_cloud
from tf_tree_py.ros.messages.do_transform import do_transform
from tf_tree_py.ros.messages.point_cloud import do_transform_cloud

POSE = (1.0, -2.0, 0.5, *so3.from_rpy(0.1, -0.2, 0.7))
POINTS = 300_000


def medians(calls: dict[str, Callable[[], object]], rounds: int,
            repeats: int) -> dict[str, list[float]]:
    """Return the seconds of each call in every round."""
    results: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            begin = time.perf_counter()
            for _ in range(repeats):
                call()
            results[name].append((time.perf_counter() - begin) / repeats)
    return results


def show(title: str, results: dict[str, list[float]], peer: str, target: str = '') -> None:
    """Print a row for each call: its time, and its ratio to the peer's in the same rounds."""
    print(f'\n{title}{target}')
    for name, seconds in results.items():
        ratio = statistics.median(a / b for a, b in zip(seconds, results[peer], strict=True))
        print(f'  {name:<44}{statistics.median(seconds) * 1e6:>12.2f} us{ratio:>9.2f}')


# --- messages


def small_messages() -> dict[str, object]:
    """Return messages in base, stamped 2 s."""
    header = Header(frame_id='base', stamp=Time(sec=2))
    corners = [Point32(x=float(number), y=1.0, z=2.0) for number in range(100)]
    several = [Pose(position=Point(x=float(number))) for number in range(100)]
    return {
        'point': PointStamped(header=header, point=Point(x=1.0, y=2.0, z=3.0)),
        'polygon of 100 points': PolygonStamped(header=header, polygon=Polygon(points=corners)),
        'pose': PoseStamped(header=header),
        'pose with covariance': PoseWithCovarianceStamped(header=header),
        'odometry': Odometry(header=header),
        'array of 100 poses': PoseArray(header=header, poses=several),
        'path of 100 poses': Path(header=header, poses=[PoseStamped(header=header, pose=pose)
                                                        for pose in several]),
    }


def filled_buffer() -> Buffer:
    """Return a buffer with map -> odom -> base -> lidar, 10 s at 100 Hz."""
    buffer = Buffer()
    for step in range(1000):
        stamp = step * NANOSECONDS_PER_SECOND // 100
        for parent, child in (('map', 'odom'), ('odom', 'base')):
            pose = (0.01 * step, 0.0, 0.0, *so3.from_rpy(0.0, 0.0, 0.001 * step))
            buffer.set_transform(transform_stamped(parent, child, stamp, pose))
    buffer.set_transform_static(transform_stamped('base', 'lidar', 0, POSE))
    return buffer


def bench_messages(rounds: int) -> None:
    """Print the cost of small messages, with a given transform and through a buffer."""
    transform = transform_stamped('map', 'base', 2 * NANOSECONDS_PER_SECOND, POSE)
    buffer, messages = filled_buffer(), small_messages()
    alone: dict[str, Callable[[], object]] = {
        name: partial(do_transform, message, transform) for name, message in messages.items()}
    looked_up: dict[str, Callable[[], object]] = {
        name: partial(buffer.transform, message, 'map') for name, message in messages.items()}
    alone['peer: PointStamped()'] = looked_up['peer: PointStamped()'] = PointStamped
    target = ': ratio to a point (polygon: 15 at most)'
    show('buffer.transform(message, "map")', medians(looked_up, rounds, 20), 'point', target)
    show('do_transform(message, transform)', medians(alone, rounds, 20), 'point', target)


# --- clouds


def cloud_of(point_step: int, code: str = '<f4') -> PointCloud2:
    """Return a cloud with random points and times, ``point_step`` bytes per point."""
    dtype = np.dtype(code)
    record = np.zeros(POINTS, dtype={
        'names': ['x', 'y', 'z', 't'], 'formats': [dtype, dtype, dtype, '<u4'],
        'offsets': [0, dtype.itemsize, 2 * dtype.itemsize, point_step - 4],
        'itemsize': point_step})
    rng = np.random.default_rng(1)
    for name in 'xyz':
        record[name] = rng.normal(size=POINTS) * 20.0
    record['t'] = np.linspace(0, NANOSECONDS_PER_SECOND // 10, POINTS)
    datatype = PointField.FLOAT32 if dtype.itemsize == 4 else PointField.FLOAT64
    offsets = record.dtype.fields
    assert offsets is not None
    fields = [PointField(name=name, offset=offsets[name][1], count=1,
                         datatype=datatype if name in 'xyz' else PointField.UINT32)
              for name in offsets]
    return PointCloud2(
        header=Header(frame_id='lidar', stamp=Time(sec=2)), height=1, width=POINTS, fields=fields,
        is_bigendian=code.startswith('>'), point_step=point_step, row_step=POINTS * point_step,
        data=array('B', record.tobytes()), is_dense=True)


def bench_clouds(rounds: int) -> None:
    """Print the cost of clouds of several layouts, compared with the bare matrix product."""
    transform: TransformStamped = transform_stamped('map', 'lidar', 0, POSE)
    rotation = np.array(so3.as_matrix(POSE[3:]), dtype=np.float32)
    translation = np.array(POSE[:3], dtype=np.float32)
    clouds = {
        'packed float32, 16 bytes a point': cloud_of(16),
        'padded float32, 32 bytes a point': cloud_of(32),
        'padded float32, 48 bytes a point': cloud_of(48),
        'unaligned float32, 23 bytes a point': cloud_of(23),
        'float64, 28 bytes a point': cloud_of(28, '<f8'),
        'big-endian float32, 16 bytes a point': cloud_of(16, '>f4'),
    }
    xyz = np.random.default_rng(1).normal(size=(POINTS, 3)).astype(np.float32) * 20
    calls: dict[str, Callable[[], object]] = {
        'peer: xyz @ R.T + t, packed float32': lambda: xyz @ rotation.T + translation}
    for name, cloud in clouds.items():
        calls[name] = partial(do_transform_cloud, cloud, transform)
    show(f'do_transform_cloud, {POINTS:,} points', medians(calls, rounds, 1), next(iter(calls)),
         ': ratio to the bare product (2.5 at most)')

    buffer, cloud = filled_buffer(), clouds['padded float32, 32 bytes a point']
    calls = {'do_transform_cloud': lambda: do_transform_cloud(cloud, transform),
             'deskew_cloud': lambda: deskew_cloud(buffer, cloud, 'lidar')}
    show(f'deskew_cloud, {POINTS:,} points, each at its own time',
         medians(calls, max(3, rounds // 3), 1), 'do_transform_cloud')


if __name__ == '__main__':
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 31
    threads = os.environ.get('OPENBLAS_NUM_THREADS', 'not set')
    print(f'numpy {np.__version__}, {number} rounds, OPENBLAS_NUM_THREADS {threads}')
    bench_messages(number)
    bench_clouds(number)
