# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
KinHEC's sequences with known ground truth, its reference solvers, and ours.

Needs ``pip install kinhec``. Sequences are generated from a seed when they are used.
"""

from collections.abc import Callable, Iterator, Sequence as Row
from functools import partial
import itertools
import math
from typing import Any, NamedTuple

from kinhec import plans, se3, solvers
from kinhec.benchmark import _keyframe_data
from kinhec.generator import generate_sequence
from kinhec.io import Sequence
import numpy as np
from tf_tree_py import BufferCore
from tf_tree_py.calibration import calibrate, Observations
from tf_tree_py.core import Pose, se3 as tf_se3, UNLIMITED

TRACKS = ('noise', 'motion', 'temporal', 'outliers')
_SEED = 25
_START = 1_700_000_000 * 10**9


class Errors(NamedTuple):
    """The errors of an estimate: degrees, millimetres, milliseconds."""

    turned_deg: float
    moved_mm: float
    late_ms: float = 0.0


def sequences(track: str, most: int | None = None) -> Iterator[Sequence]:
    """
    Yield the sequences of a track of KinHEC's tier 'small'.

    :param most: the maximum number, taken evenly from all.
    """
    for config in _plan(track, most):
        yield made(config)


def _plan(track: str, most: int | None) -> Row[Any]:
    spec = plans.load_tier('small')
    spec['global_seed'] = _SEED
    plan = {name: getattr(plans, f'plan_{name}') for name in TRACKS}[track](spec)
    if most is None or most >= len(plan):
        return plan
    chosen = np.unique(np.linspace(0, len(plan) - 1, most).round().astype(int))
    return [plan[index] for index in chosen]


def late_and_jittering(count: int, offset_s: float = 0.05,
                       jitter_s: float = 0.005) -> Iterator[Sequence]:
    """Yield sequences of the temporal track with an offset and jitter of the stamps."""
    spec = plans.load_tier('small')
    spec['global_seed'] = _SEED
    spec['tracks']['temporal'] |= {
        'time_offset_s': [offset_s], 'jitter_std_s': [jitter_s], 'camera_rate_hz': [30],
        'repeats': math.ceil(count / 2)}
    for config in itertools.islice(plans.plan_temporal(spec), count):
        yield made(config)


def with_outliers(count: int, fraction: float = 0.2) -> Iterator[Sequence]:
    """Yield sequences of the outliers track with one fraction of outliers."""
    spec = plans.load_tier('small')
    spec['global_seed'] = _SEED
    spec['tracks']['outliers'] |= {'fraction': [fraction], 'student_t_dof': [None],
                                   'repeats': math.ceil(count / 4)}
    for config in itertools.islice(plans.plan_outliers(spec), count):
        yield made(config)


def made(config: Any) -> Sequence:
    """Return the sequence that KinHEC generates from a configuration."""
    record = generate_sequence(config)
    return Sequence(record.manifest, record.robot_table, record.camera_table)


def truth(sequence: Sequence) -> np.ndarray:
    """Return the true hand-eye transform X of a sequence, (4, 4)."""
    return np.asarray(sequence.X)


def ours(sequence: Sequence, *, time: bool = False) -> Errors:
    """Return the errors of ``calibrate``; the tree contains the mounting from ``drawn``."""
    in_hand = sequence.manifest['configuration'] == 'eye_in_hand'
    found = calibrate(*(_eye_in_hand(sequence) if in_hand else _eye_to_hand(sequence)), time=time)
    X = found.edge.after if in_hand else found.places['flange', 'marker']
    late = sequence.manifest['time_offset_s']
    return Errors(*errors(X.as_matrix(), truth(sequence)),
                  1e3 * abs((found.time_offset_s or 0.0) - late) if time else 0.0)


def _eye_in_hand(sequence: Sequence) -> tuple[BufferCore, tuple[str, str], Observations]:
    """Return a tree with a wrong camera mounting on the flange, that edge, the observations."""
    tree = _arm(sequence)
    tree.insert('flange', 'camera', 0, drawn(sequence, truth(sequence)), static=True)
    return tree, ('flange', 'camera'), _seen(sequence, 'base', 'board')


def _eye_to_hand(sequence: Sequence) -> tuple[BufferCore, tuple[str, str], Observations]:
    """Return a tree with a wrong camera mounting in the room; a marker is fixed to the flange."""
    tree = _arm(sequence)
    tree.insert('base', 'camera', 0, drawn(sequence, np.asarray(sequence.Y)), static=True)
    return tree, ('base', 'camera'), _seen(sequence, 'flange', 'marker')


def _arm(sequence: Sequence) -> BufferCore:
    buffer = BufferCore(cache_time=UNLIMITED)
    buffer.insert_track('base', 'flange', _stamps(sequence.robot.t), _poses(
        sequence.robot.T_base_ee_meas))
    return buffer


def _seen(sequence: Sequence, fixed_in: str, target: str) -> Observations:
    seen = sequence.camera.T_cam_target_meas
    kept = np.isfinite(seen).all(axis=(1, 2))
    return Observations('camera', _stamps(sequence.camera.t)[kept], _poses(seen[kept]),
                        fixed_in, target)


def drawn(sequence: Sequence, true: np.ndarray) -> Pose:
    """
    Return a mounting as in a drawing: 10 degrees and 5 cm off, in any direction.

    The estimate keeps this error only in directions that the motion does not make observable.
    """
    rng = np.random.default_rng(sequence.manifest['seed'])
    turn, shift = (each / np.linalg.norm(each) for each in rng.normal(size=(2, 3)))
    pose = Pose.from_matrix(true)
    turned = Pose.from_rotation_vector(np.radians(10.0) * turn) @ pose
    return Pose.from_parts(np.add(pose[:3], 0.05 * shift), turned.rotation)


def reference(sequence: Sequence, *, offset_s: float | None = None) -> Errors:
    """
    Return the errors of Shah's closed form with KinHEC's refinement.

    :param offset_s: the offset of the stamps; None: the true one.
    """
    data = _keyframe_data(sequence, offset_s)
    if data is None:
        return Errors(math.nan, math.nan)
    A, B = data[:2]
    X, _ = solvers.refine_lm_axyb(A, B, *solvers.shah(A, B))
    return Errors(*errors(X, truth(sequence)))


def reference_with_time(sequence: Sequence) -> Errors:
    """Return the errors of KinHEC's estimate of the offset, followed by its solver."""
    offset, _ = solvers.estimate_time_offset(
        sequence.robot.t, sequence.robot.T_base_ee_meas, sequence.camera.t,
        sequence.camera.T_cam_target_meas)
    found = reference(sequence, offset_s=offset)
    return found._replace(late_ms=1e3 * abs(offset - sequence.manifest['time_offset_s']))


def errors(X: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """Return the errors of an estimate, degrees and millimetres."""
    turned, moved = se3.pose_error(X, true)
    return float(turned), float(moved)


STATISTICS: dict[str, Callable[..., np.ndarray]] = {
    'mean': np.nanmean, 'median': np.nanmedian,
    '90th percentile': partial(np.nanpercentile, q=90.0)}
"""What is compared over all sequences of a track."""


def mean(found: Row[Errors]) -> Errors:
    """Return the mean of the errors."""
    return over(found, 'mean')


def over(found: Row[Errors], statistic: str) -> Errors:
    """Return one of ``STATISTICS`` of the errors."""
    return Errors(*STATISTICS[statistic](np.array(found), axis=0).tolist())


def _stamps(seconds: np.ndarray) -> np.ndarray:
    return _START + np.round(seconds * 1e9).astype(np.int64)


def _poses(matrices: np.ndarray) -> np.ndarray:
    return np.asarray(tf_se3.from_matrix_many(matrices))
