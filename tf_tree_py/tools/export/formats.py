# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Trajectories as bytes: TUM for evo, CSV, numpy's archives, Parquet, and two viewers' formats.

Foxglove reads MCAP with messages of ``foxglove.FrameTransforms``
(https://docs.foxglove.dev/docs/sdk/schemas/frame-transforms), rerun its own recordings.
"""

from collections.abc import Callable, Iterable, Mapping
import io
import json
from typing import Any, Final

import numpy as np
from tf_tree_py.beyond.motion.trajectory import Trajectory
from tf_tree_py.command.endings import Cannot, needs
from tf_tree_py.core.geometry.so3 import Array
from tf_tree_py.core.stamp import format_stamp

_SECOND: Final = 1_000_000_000
_TOPIC: Final = '/tf'


def _object(**properties: Mapping[str, object]) -> dict[str, object]:
    return {'type': 'object', 'properties': properties}


_NUMBER: Final = {'type': 'number'}
_TIME: Final = _object(sec={'type': 'integer'}, nsec={'type': 'integer'})
_XYZ: Final = dict.fromkeys('xyz', _NUMBER)
_SCHEMA: Final = _object(transforms={'type': 'array', 'items': _object(
    timestamp=_TIME, parent_frame_id={'type': 'string'}, child_frame_id={'type': 'string'},
    translation=_object(**_XYZ), rotation=_object(**_XYZ, w=_NUMBER))})


def _as_foxglove(trajectory: Trajectory) -> bytes:
    """Return an MCAP with a message of ``foxglove.FrameTransforms`` for each pose."""
    _check(trajectory)
    needs('mcap', 'mcap')
    from mcap.writer import Writer
    file = io.BytesIO()
    writer = Writer(file)
    writer.start(library='tf_tree_py')
    schema = writer.register_schema('foxglove.FrameTransforms', 'jsonschema',
                                    json.dumps(_SCHEMA).encode())
    channel = writer.register_channel(_TOPIC, 'json', schema)
    for stamp, pose in zip(trajectory.stamps.tolist(), trajectory.poses.tolist(), strict=True):
        message = {'transforms': [_frame_transform(trajectory, stamp, pose)]}
        writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
    writer.finish()
    return file.getvalue()


def _frame_transform(trajectory: Trajectory, stamp: int, pose: list[float]) -> dict[str, object]:
    seconds, rest = divmod(stamp, _SECOND)
    return {
        'timestamp': {'sec': seconds, 'nsec': rest},
        'parent_frame_id': trajectory.target_frame, 'child_frame_id': trajectory.source_frame,
        'translation': dict(zip('xyz', pose[:3], strict=True)),
        'rotation': dict(zip('xyzw', pose[3:], strict=True)),
    }


def _as_rrd(trajectory: Trajectory) -> bytes:
    """Return a recording of rerun: ``Transform3D`` of the entity /target/source."""
    _check(trajectory)
    rerun = needs('rerun', 'rerun-sdk')
    stream = rerun.RecordingStream('tf_tree_py')
    sink = stream.binary_stream()
    entity = rerun.new_entity_path([trajectory.target_frame, trajectory.source_frame])
    stamps = trajectory.stamps.astype('datetime64[ns]')
    stream.send_columns(
        entity, [rerun.TimeColumn('stamp', timestamp=stamps)],
        rerun.Transform3D.columns(translation=trajectory.poses[:, :3],
                                  quaternion=trajectory.poses[:, 3:]))
    data = sink.read(flush=True)
    if data is None:
        raise Cannot('rerun wrote nothing')
    return bytes(data)


def _check(trajectory: Trajectory) -> None:
    if trajectory.twists is not None:
        raise Cannot('viewers take poses, not velocities: omit --twist')
    if np.isnan(trajectory.poses).any():
        raise Cannot('viewers cannot show NaN: omit --outside nan')


# --- formats

_POSE = ('x_m', 'y_m', 'z_m', 'qx', 'qy', 'qz', 'qw')
_TWIST = ('vx_m_per_s', 'vy_m_per_s', 'vz_m_per_s',
          'wx_rad_per_s', 'wy_rad_per_s', 'wz_rad_per_s')


def columns_of(trajectory: Trajectory) -> list[str]:
    """Return the names of the columns; a suffix is the unit, quaternions have none."""
    return ['stamp_ns', *_POSE, *(_TWIST if trajectory.twists is not None else ())]


def _rows(trajectory: Trajectory, separator: str) -> Iterable[str]:
    """Yield the numbers of each row except its stamp, so that reading returns equal numbers."""
    numbers = _numbers(trajectory)
    # Seventeen digits distinguish any two floats, and are faster than the shortest exact form.
    form = separator.join(['%.17g'] * numbers.shape[1])
    return (form % tuple(row) for row in numbers.tolist())


def _numbers(trajectory: Trajectory) -> Array:
    """Return all columns except the stamps."""
    return np.asarray(trajectory.poses) if trajectory.twists is None else np.hstack(
        [trajectory.poses, trajectory.twists])


def _as_tum(trajectory: Trajectory) -> bytes:
    """
    Return lines of seconds, position and quaternion, as evo reads them.

    The format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats.
    """
    if trajectory.twists is not None:
        raise Cannot('TUM files have no velocities: use --format csv, or omit --twist')
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
    pandas = needs('pandas', 'pandas')
    needs('pyarrow', 'pyarrow')
    frame = pandas.DataFrame(_numbers(trajectory), columns=columns_of(trajectory)[1:])
    frame.insert(0, 'stamp_ns', trajectory.stamps)
    frame.attrs = {'target_frame': trajectory.target_frame,
                   'source_frame': trajectory.source_frame}
    written: bytes = frame.to_parquet(engine='pyarrow', index=False)
    return written


FORMATS: dict[str, Callable[[Trajectory], bytes]] = {
    'tum': _as_tum, 'csv': _as_csv, 'npz': _as_npz, 'parquet': _as_parquet,
    'foxglove': _as_foxglove, 'rrd': _as_rrd}
"""For each format, the function that converts a trajectory to a file."""

BINARY = ('npz', 'parquet', 'foxglove', 'rrd')
_SUFFIXES = {'mcap': 'foxglove', 'txt': 'tum', '': 'tum'}


def format_of(suffix: str) -> str | None:
    """Return the format for the suffix of a file; TUM without one, None for an unknown one."""
    name = suffix.removeprefix('.')
    name = _SUFFIXES.get(name, name)
    return name if name in FORMATS else None
