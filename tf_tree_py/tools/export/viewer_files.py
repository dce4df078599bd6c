# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Trajectories for viewers: Foxglove and rerun.

Foxglove reads MCAP with messages of ``foxglove.FrameTransforms``
(https://docs.foxglove.dev/docs/sdk/schemas/frame-transforms), rerun its own recordings.
"""

import io
import json
from typing import Any, Final

import numpy as np
from tf_tree_py.beyond.motion.trajectory import Trajectory
from tf_tree_py.command.endings import Cannot, needs

_SECOND: Final = 1_000_000_000
_TOPIC: Final = '/tf'


def _object(**properties: dict[str, Any]) -> dict[str, Any]:
    return {'type': 'object', 'properties': properties}


_NUMBER: Final = {'type': 'number'}
_TIME: Final = _object(sec={'type': 'integer'}, nsec={'type': 'integer'})
_XYZ: Final = dict.fromkeys('xyz', _NUMBER)
_SCHEMA: Final = _object(transforms={'type': 'array', 'items': _object(
    timestamp=_TIME, parent_frame_id={'type': 'string'}, child_frame_id={'type': 'string'},
    translation=_object(**_XYZ), rotation=_object(**_XYZ, w=_NUMBER))})


def as_foxglove(trajectory: Trajectory) -> bytes:
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


def _frame_transform(trajectory: Trajectory, stamp: int, pose: list[float]) -> dict[str, Any]:
    seconds, rest = divmod(stamp, _SECOND)
    return {
        'timestamp': {'sec': seconds, 'nsec': rest},
        'parent_frame_id': trajectory.target_frame, 'child_frame_id': trajectory.source_frame,
        'translation': dict(zip('xyz', pose[:3], strict=True)),
        'rotation': dict(zip('xyzw', pose[3:], strict=True)),
    }


def as_rrd(trajectory: Trajectory) -> bytes:
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
