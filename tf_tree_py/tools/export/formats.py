# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Trajectories as bytes: TUM for evo, CSV, numpy's archives, and Parquet."""

from collections.abc import Callable, Iterable
import io
from typing import Any

import numpy as np
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.core.trajectory import Trajectory

from ..endings import Cannot, needs

_POSE = ('x_m', 'y_m', 'z_m', 'qx', 'qy', 'qz', 'qw')
_TWIST = ('vx_m_per_s', 'vy_m_per_s', 'vz_m_per_s',
          'wx_rad_per_s', 'wy_rad_per_s', 'wz_rad_per_s')


def columns_of(trajectory: Trajectory) -> list[str]:
    """Return the names of the columns; a suffix is the unit, and quaternions have none."""
    return ['stamp_ns', *_POSE, *(_TWIST if trajectory.twists is not None else ())]


def _rows(trajectory: Trajectory, separator: str) -> Iterable[str]:
    """Yield the numbers of each row but its stamp, such that reading them gives the same."""
    numbers = _numbers(trajectory)
    # Seventeen digits tell any two floats apart, and take less time than the fewest that do.
    form = separator.join(['%.17g'] * numbers.shape[1])
    return (form % tuple(row) for row in numbers.tolist())


def _numbers(trajectory: Trajectory) -> Array:
    """Return all columns but the stamps."""
    return trajectory.poses if trajectory.twists is None else np.hstack(
        [trajectory.poses, trajectory.twists])


def _as_tum(trajectory: Trajectory) -> bytes:
    """
    Return lines of seconds, position and quaternion, as evo reads them.

    The format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats.
    """
    if trajectory.twists is not None:
        raise Cannot('TUM files have no velocities: take --format csv, or leave --twist out')
    target, source = (' '.join(name.split()) for name in trajectory[:2])
    lines = [f'# {source} in {target}', '# timestamp_s x_m y_m z_m qx qy qz qw']
    lines += [f'{format_stamp(stamp)} {row}' for stamp, row
              in zip(trajectory.stamps.tolist(), _rows(trajectory, ' '), strict=True)]
    return _text(lines)


def _as_csv(trajectory: Trajectory) -> bytes:
    lines = [','.join(columns_of(trajectory))]
    lines += [f'{stamp},{row}' for stamp, row
              in zip(trajectory.stamps.tolist(), _rows(trajectory, ','), strict=True)]
    return _text(lines)


def _text(lines: list[str]) -> bytes:
    return ('\n'.join(lines) + '\n').encode()


def _as_npz(trajectory: Trajectory) -> bytes:
    """Return an archive that ``numpy.load`` opens: an array for each kind of column."""
    arrays: dict[str, Any] = {
        'stamp_ns': trajectory.stamps, 'position_m': trajectory.poses[:, :3],
        'quaternion_xyzw': trajectory.poses[:, 3:]}
    if trajectory.twists is not None:
        arrays |= {'linear_m_per_s': trajectory.twists[:, :3],
                   'angular_rad_per_s': trajectory.twists[:, 3:]}
    file = io.BytesIO()
    np.savez(file, target_frame=np.array(trajectory.target_frame),
             source_frame=np.array(trajectory.source_frame), **arrays)
    return file.getvalue()


def _as_parquet(trajectory: Trajectory) -> bytes:
    pandas = needs('pandas', 'pandas', 'export')
    needs('pyarrow', 'pyarrow', 'export')
    frame = pandas.DataFrame(_numbers(trajectory), columns=columns_of(trajectory)[1:])
    frame.insert(0, 'stamp_ns', trajectory.stamps)
    frame.attrs = {'target_frame': trajectory.target_frame,
                   'source_frame': trajectory.source_frame}
    written: bytes = frame.to_parquet(engine='pyarrow', index=False)
    return written


FORMATS: dict[str, Callable[[Trajectory], bytes]] = {
    'tum': _as_tum, 'csv': _as_csv, 'npz': _as_npz, 'parquet': _as_parquet}
"""Of each format, what makes a file of a trajectory."""

BINARY = ('npz', 'parquet')


def format_of(suffix: str) -> str:
    """Return the format that goes by the suffix of a file; TUM, whatever else it is."""
    name = suffix.removeprefix('.')
    return name if name in FORMATS else 'tum'
